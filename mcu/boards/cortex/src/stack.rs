//! The stack's guard and its high-water mark.
//!
//! ```text
//! start of RAM | statics | .uninit | guard, 1 KiB | … free … | stack, growing down | end of RAM
//! ```
//!
//! The start-up code paints the free part (`cortex-m-rt`'s `paint-stack`); what lost its paint was used.
use cortex_m::{asm, peripheral::MPU};
use cortex_m_rt::STACK_PAINT_VALUE;

const GUARD: usize = 1024;

unsafe extern "C" {
    // Placed by the linker: the first address above the stack, and the last that it may reach.
    static _stack_start: u32;
    static _stack_end: u32;
}

fn top() -> usize {
    &raw const _stack_start as usize
}

fn guard_start() -> usize {
    (&raw const _stack_end as usize).next_multiple_of(GUARD)
}

/// Forbids access to the guard. In the fault handler, where the rule is off, the guard is the stack to run on.
pub fn guard(mpu: &MPU) {
    const NUMBER_IN_ADDRESS: u32 = 1 << 4;
    const NO_EXECUTION: u32 = 1 << 28;
    const SIZE_1_KIB: u32 = 9 << 1;
    const ENABLE: u32 = 1;
    const DEFAULT_MAP_ELSEWHERE: u32 = 1 << 2;
    // SAFETY: the region lies between statics and stack and is never used, so that nothing valid becomes unreachable.
    unsafe {
        mpu.rbar.write(guard_start() as u32 | NUMBER_IN_ADDRESS);
        mpu.rasr.write(NO_EXECUTION | SIZE_1_KIB | ENABLE);
        mpu.ctrl.write(DEFAULT_MAP_ELSEWHERE | ENABLE);
    }
    asm::dsb();
    asm::isb();
}

/// Bytes that the stack can take.
pub fn size() -> u32 {
    (top() - guard_start() - GUARD) as u32
}

/// The deepest the stack has been, in bytes.
pub fn used() -> u32 {
    let words = (guard_start() + GUARD..top()).step_by(4);
    // SAFETY: the addresses lie in RAM, are aligned and above the guard; the words below the stack pointer hold paint or
    // what calls left there, and any bits are a `u32`.
    let painted =
        words.take_while(|word| unsafe { (*word as *const u32).read_volatile() } == STACK_PAINT_VALUE);
    size() - 4 * painted.count() as u32
}
