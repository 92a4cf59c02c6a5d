//! Synthetic floors, walls, doors and walkers with exact truth.
