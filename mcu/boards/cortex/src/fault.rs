//! What ends a run, and the note it leaves for the next.
use core::{fmt, mem::MaybeUninit, panic::PanicInfo};
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use monorange_mcu::restart::LastRun;
use monorange_protocol::message::RestartCause;

/// Start-up code leaves `.uninit` as it was.
#[unsafe(link_section = ".uninit.LAST_RUN")]
static mut LAST_RUN: MaybeUninit<LastRun> = MaybeUninit::uninit();

fn kept() -> *mut MaybeUninit<LastRun> {
    &raw mut LAST_RUN
}

/// What the last run left behind.
pub fn begin() -> LastRun {
    // SAFETY: called once, before anything that can end the run; the handlers below do not return. Any bits are a
    // `LastRun`, which believes its own checksum only.
    unsafe { (&mut *kept()).assume_init_mut() }.begin()
}

/// Records why this run ends, and restarts.
pub fn end(cause: RestartCause, text: impl fmt::Display) -> ! {
    cortex_m::interrupt::disable();
    // SAFETY: this run ends here, with interrupts off: nobody else uses the record any more.
    unsafe { (&mut *kept()).assume_init_mut() }.record(cause, text);
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(RestartCause::Panic, info)
}

/// Also a memory or bus fault, a stack overflow by its guard, and a bad instruction: none has a handler of its own.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    const CONFIGURABLE_FAULT_STATUS: *const u32 = 0xe000_ed28 as *const u32;
    // SAFETY: a register of the processor, aligned, whose reading changes nothing.
    let status = unsafe { CONFIGURABLE_FAULT_STATUS.read_volatile() };
    let (pc, lr) = (frame.pc(), frame.lr());
    end(RestartCause::HardFault, format_args!("pc {pc:#010x} lr {lr:#010x} cfsr {status:#010x}"))
}
