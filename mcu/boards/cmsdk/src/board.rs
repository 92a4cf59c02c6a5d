//! Time, cost and watchdog.
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::exception;
use monorange_mcu::Board;
use monorange_protocol::message::{CostUnit, RestartCause};

const TIMER0_CTRL: usize = 0x4000_0000;
const TIMER0_VALUE: usize = 0x4000_0004;
const TIMER0_RELOAD: usize = 0x4000_0008;
const TIMER_ENABLE: u32 = 1;
const WATCHDOG_LOAD: usize = 0x4000_8000;
const WATCHDOG_CTRL: usize = 0x4000_8008;
const WATCHDOG_INTERRUPT_CLEAR: usize = 0x4000_800c;
const WATCHDOG_LOCK: usize = 0x4000_8c00;
const WATCHDOG_KEY: u32 = 0x1acc_e551;
/// Interrupt (the non-maskable one) at the first time-out, reset at the second.
const WATCHDOG_ENABLE: u32 = 3;

/// Of all timers: 25 MHz.
pub const TICKS_PER_US: u32 = 25;
const WATCHDOG_TICKS: u32 = 2_000_000 * TICKS_PER_US;
const WAKE_TICKS: u32 = 100_000 * TICKS_PER_US;

#[inline]
fn read(register: usize) -> u32 {
    // SAFETY: called with the registers above only; they are words, aligned, and reading them has no effect on memory.
    unsafe { (register as *const u32).read_volatile() }
}

#[inline]
fn write(register: usize, value: u32) {
    // SAFETY: as in `read`; timer and watchdog change no memory.
    unsafe { (register as *mut u32).write_volatile(value) }
}

/// Timer 0, turned to count upwards; wraps after 171 s.
#[inline]
pub fn ticks() -> u32 {
    u32::MAX - read(TIMER0_VALUE)
}

static INTERRUPT_TICKS: AtomicU32 = AtomicU32::new(0);

/// Notes the cost of an interrupt; for the interrupt.
#[inline]
pub fn interrupt_took(ticks: u32) {
    INTERRUPT_TICKS.store(INTERRUPT_TICKS.load(Ordering::Relaxed).wrapping_add(ticks), Ordering::Relaxed);
}

/// The board.
pub struct Mps2 {
    /// Ticks since the start, up to the last [`tick`](Self::tick).
    uptime: u64,
    last: u32,
}

impl Mps2 {
    /// Starts timers and watchdog.
    pub fn start(systick: &mut SYST) -> Self {
        write(TIMER0_RELOAD, u32::MAX);
        write(TIMER0_VALUE, u32::MAX);
        write(TIMER0_CTRL, TIMER_ENABLE);
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(WAKE_TICKS - 1);
        systick.clear_current();
        systick.enable_interrupt();
        systick.enable_counter();
        write(WATCHDOG_LOCK, WATCHDOG_KEY);
        write(WATCHDOG_LOAD, WATCHDOG_TICKS);
        write(WATCHDOG_CTRL, WATCHDOG_ENABLE);
        Self { uptime: 0, last: ticks() }
    }

    /// Starts the watchdog's time anew.
    pub fn feed_watchdog(&mut self) {
        self.alive();
        self.tick();
    }

    /// Notes the time; at least every 171 s.
    pub fn tick(&mut self) {
        let now = ticks();
        self.uptime += u64::from(now.wrapping_sub(self.last));
        self.last = now;
    }
}

impl Board for Mps2 {
    const NAME: &'static str = env!("MONORANGE_BOARD");
    const COST_UNIT: CostUnit = CostUnit::Instructions;

    fn cost(&self) -> u32 {
        // Once more if an interrupt came between the two: else time would run backwards.
        loop {
            let before = INTERRUPT_TICKS.load(Ordering::Relaxed);
            let now = ticks();
            if INTERRUPT_TICKS.load(Ordering::Relaxed) == before {
                return now.wrapping_sub(before);
            }
        }
    }
    fn interrupt_cost(&self) -> u32 {
        INTERRUPT_TICKS.load(Ordering::Relaxed)
    }
    fn units_from_ticks(ticks: u32) -> u32 {
        // QEMU with `-icount shift=5` lets an instruction take 32 ns, and a tick is 40 ns.
        ticks.saturating_add(ticks / 4)
    }
    fn uptime_us(&self) -> u64 {
        (self.uptime + u64::from(ticks().wrapping_sub(self.last))) / u64::from(TICKS_PER_US)
    }
    fn stack_used(&self) -> u32 {
        monorange_cortex::stack::used()
    }
    fn stack_size(&self) -> u32 {
        monorange_cortex::stack::size()
    }
    fn overrun(&self) -> u32 {
        crate::uart::RING.overrun()
    }
    fn alive(&self) {
        write(WATCHDOG_INTERRUPT_CLEAR, 1);
    }
}

/// Only wakes the main loop.
#[exception]
fn SysTick() {
    crate::uart::wake();
}

/// The watchdog's first time-out.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    monorange_cortex::fault::end(RestartCause::Watchdog, "the main loop did not come round in 2 s")
}
