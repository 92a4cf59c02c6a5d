"""What the network sees of a proposal: features on even scales, grey relative to its own mean and spread."""
import numpy as np

LOG = "log"
SIGNED = "signed"
PLAIN = "plain"
LIMIT = 4.0
"""Inputs end at so many standard deviations."""
LEFT_OUT = {"vertical_brighter_right", "noise", "floor_grey"}
"""Features that the network does not see: what it is turned by, and what says more of the camera than of the place."""
KINDS = {
    LOG: (
        "vertical_length vertical_gradient vertical_height left_points left_length left_gradient right_points right_length"
        " right_gradient next_below_points next_below_gradient lines_below edge_below edge_near_below contrast_above contrast_below"
        " contrast_floor unlike_floor texture_below texture_sides texture_above border border_below range disagreement"
    ).split(),
    SIGNED: "below_end above_left above_right below_left below_right straight_below far_below".split(),
}
KIND_OF = {name: kind for kind, names in KINDS.items() for name in names}


def shaped(values, kind):
    if kind == LOG:
        return np.log1p(np.maximum(values, 0.0))
    if kind == SIGNED:
        return np.sign(values) * np.log1p(np.abs(values))
    return values


def pooled(picture):
    """Means of 2 × 2 samples."""
    return (picture[:, ::2, ::2] + picture[:, 1::2, ::2] + picture[:, ::2, 1::2] + picture[:, 1::2, 1::2]) / 4.0


def plain(picture):
    """What a straight score sees of each proposal; `core/src/proposals/score.rs` says the same."""
    f = {name: picture.features[:, i] for i, name in enumerate(picture.names)}
    length = np.log(np.maximum(f["vertical_length"], 5.0))
    one_sided = (f["both"] == 0) | (f["left_brighter_below"] == f["right_brighter_below"])
    columns = [
        np.log(f["unlike_floor"] + 0.3),
        0.25 * length * length,
        np.log(f["contrast_above"] + 0.5),
        np.log(f["texture_below"] + 0.5),
        np.minimum(f["vertical_width"], 4.0),
        np.minimum(f["edge_below"], 4.0),
        np.minimum(f["vertical_below"], 1.0),
        np.clip(f["below_end"], 0.0, 20.0) / 10.0,
        np.minimum(f["lines_below"], 3.0),
        one_sided,
        f["vertical_turn"],
        f["vertical_length"] == 0,
    ]
    return np.stack(columns, 1).astype(np.float64)


class Inputs:
    def __init__(self, names, mean, spread):
        self.names, self.mean, self.spread = names, mean, spread
        self.kinds = [KIND_OF.get(name, PLAIN) for name in names]

    @classmethod
    def measured(cls, pictures):
        """Scales such that each feature of these pictures has mean 0 and deviation 1."""
        names = [name for name in pictures[0].names if name not in LEFT_OUT]
        one = cls(names, np.zeros(len(names), np.float32), np.ones(len(names), np.float32))
        values = np.concatenate([one.shaped(picture) for picture in pictures])
        return cls(names, values.mean(0).astype(np.float32), (values.std(0) + 1e-3).astype(np.float32))

    def shaped(self, picture):
        column = {name: i for i, name in enumerate(picture.names)}
        return np.stack([shaped(picture.features[:, column[name]], kind) for name, kind in zip(self.names, self.kinds)], 1)

    def features(self, picture):
        return np.clip((self.shaped(picture) - self.mean) / self.spread, -LIMIT, LIMIT).astype(np.float32)

    def pixels(self, picture):
        """Both pictures round the proposal: the nearer one by means of 2 × 2, both less their mean, over spread and noise."""
        if getattr(picture, "cached", None) is None:
            noise = picture.features[:, picture.names.index("noise")][:, None]
            parts = []
            for grey in (pooled(picture.patch.astype(np.float32)), picture.context.astype(np.float32)):
                grey = grey.reshape(len(grey), -1)
                less = grey - grey.mean(1, keepdims=True)
                parts.append(np.clip(less / (less.std(1, keepdims=True) + noise), -LIMIT, LIMIT))
            picture.cached = np.concatenate(parts, 1).astype(np.float32)
        return picture.cached
