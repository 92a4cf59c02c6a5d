//! UART 0, the line: CMSDK APB UART (Arm DDI 0479, chapter 4.3).
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::{asm, interrupt, interrupt::InterruptNumber, peripheral::NVIC};
use cortex_m_rt::exception;
use monorange_mcu::{
    Ring, WINDOW,
    patience::{Patience, Stuck},
};

/// Bytes from the interrupt to the main loop.
pub static RING: Ring<WINDOW> = Ring::new();

const UART0: usize = 0x4000_4000;
const DATA: usize = UART0;
const STATE: usize = UART0 + 4;
const CTRL: usize = UART0 + 8;
const INTERRUPT_CLEAR: usize = UART0 + 12;
const BAUD_DIVIDER: usize = UART0 + 16;

const STATE_TX_FULL: u32 = 1;
const STATE_RX_FULL: u32 = 2;
const CTRL_TX: u32 = 1;
const CTRL_RX: u32 = 2;
const CTRL_RX_INTERRUPT: u32 = 8;
const CLEAR_RX: u32 = 2;
/// 25 MHz / 27 = 925,926 baud, 0.5 % above 921,600. QEMU does not mind.
const DIVIDER: u32 = 27;

/// How long a byte may wait for the line before the answer that it belongs to is given up.
const PATIENCE_TICKS: u32 = crate::board::TICKS_PER_US * 100_000;

#[derive(Clone, Copy)]
struct ReceiveInterrupt;

// SAFETY: number 0 is UART 0's receive interrupt on both boards (Arm AN386 and AN500, table of interrupts).
unsafe impl InterruptNumber for ReceiveInterrupt {
    fn number(self) -> u16 {
        0
    }
}

fn read(register: usize) -> u32 {
    // SAFETY: called with UART 0's registers only; they are words, aligned, and reading them has no effect on memory.
    unsafe { (register as *const u32).read_volatile() }
}

fn write(register: usize, value: u32) {
    // SAFETY: as in `read`; a UART moves bytes and interrupts, and no memory.
    unsafe { (register as *mut u32).write_volatile(value) }
}

/// The sending side.
pub struct Port {
    patience: Patience,
}

impl Port {
    /// Starts the UART, and its receive interrupt.
    pub fn start() -> Self {
        write(BAUD_DIVIDER, DIVIDER);
        write(CTRL, CTRL_TX | CTRL_RX | CTRL_RX_INTERRUPT);
        // SAFETY: what the handler shares with the main loop is `RING` and atomics, which are ready from the start.
        unsafe { NVIC::unmask(ReceiveInterrupt) };
        Self { patience: Patience::new() }
    }

    fn wait(&mut self) -> Result<(), Stuck> {
        if read(STATE) & STATE_TX_FULL == 0 {
            self.patience.moved();
            return Ok(());
        }
        self.wait_long()
    }

    fn wait_long(&mut self) -> Result<(), Stuck> {
        let start = crate::board::ticks();
        let late = || crate::board::ticks().wrapping_sub(start) > PATIENCE_TICKS;
        self.patience.wait(|| read(STATE) & STATE_TX_FULL == 0, late)
    }
}

impl embedded_io::ErrorType for Port {
    type Error = Stuck;
}
impl embedded_io::Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Stuck> {
        for byte in bytes {
            self.wait()?;
            write(DATA, u32::from(*byte));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Stuck> {
        self.wait()
    }
}

static TICKED: AtomicBool = AtomicBool::new(false);

/// Ends the sleep; for the interrupt that does so now and then.
pub fn wake() {
    TICKED.store(true, Ordering::Relaxed);
}

/// Sleeps until a frame may have come, or until the next [`wake`].
pub fn sleep_until_frame() {
    // With interrupts masked none comes between the look and the sleep; a pending one ends the sleep all the same.
    while !interrupt::free(|_| {
        let awake = RING.take_ready() | TICKED.load(Ordering::Relaxed);
        if !awake {
            asm::wfi();
        }
        awake
    }) {}
    TICKED.store(false, Ordering::Relaxed);
}

/// The only peripheral interrupt that is unmasked: bytes of the line to the ring.
#[exception]
unsafe fn DefaultHandler(_number: i16) {
    let start = crate::board::ticks();
    write(INTERRUPT_CLEAR, CLEAR_RX);
    RING.fill(|| (read(STATE) & STATE_RX_FULL != 0).then(|| read(DATA) as u8));
    crate::board::interrupt_took(crate::board::ticks().wrapping_sub(start));
}
