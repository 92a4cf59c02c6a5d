//! The monorange co-processor on ST's Nucleo-H743ZI2. **Built by every check, not yet run on the board.**
//!
//! | resource | use |
//! |---|---|
//! | USART 3 (PD8 out, PD9 in) | the line: the ST-LINK's virtual serial port, 921,600 baud |
//! | clocks | 8 MHz from the ST-LINK, 480 MHz for the core |
//! | DWT | cycles: time, and the cost of stages |
//! | SysTick | wakes the main loop every 30 ms |
//! | IWDG 1 | watchdog, fed by the main loop only; 2 s |
//! | caches | on, for code in flash |
//! | MPU region 0 | no access to the last KiB of the stack |
#![no_std]
#![no_main]

mod board;

use board::Nucleo;
use core::mem::MaybeUninit;
use cortex_m_rt::entry;
use embassy_stm32::{
    bind_interrupts, peripherals,
    usart::{self, BufferedUart},
    wdg::IndependentWatchdog,
};
use embedded_io::{Read, ReadReady, Write};
use monorange_cortex::{fault, stack};
use monorange_mcu::{Arrays, Device, Mapper, WINDOW, Wish};
use monorange_protocol::frame::MAX_ENCODED;

/// Of the line. The ST-LINK's virtual port takes up to about 2 Mbaud; an adapter at the pins takes 3.
const BAUD: u32 = 921_600;
const WATCHDOG_US: u32 = 2_000_000;

bind_interrupts!(struct Interrupts {
    USART3 => usart::BufferedInterruptHandler<peripherals::USART3>;
});

#[entry]
fn main() -> ! {
    // Made safe by `entry`, which runs once.
    static mut ARRAYS: Arrays = Arrays::new();
    static mut DEVICE: MaybeUninit<Device<Mapper>> = MaybeUninit::uninit();
    // The HAL starts to send only after the whole frame is in here: a longer one would never end.
    static mut SENDING: [u8; 2 * MAX_ENCODED] = [0; 2 * MAX_ENCODED];
    static mut RECEIVED: [u8; WINDOW] = [0; WINDOW];

    let last_run = fault::begin();
    let peripherals = embassy_stm32::init(board::clocks());
    let Some(cortex_m::Peripherals {
        SYST: mut systick,
        MPU: mpu,
        DCB: mut dcb,
        DWT: mut dwt,
        SCB: mut scb,
        CPUID: mut cpuid,
        ..
    }) = cortex_m::Peripherals::take()
    else {
        panic!("the processor's peripherals are taken already");
    };
    stack::guard(&mpu);
    // Code runs from flash with four wait states. Data are in the DTCM, which needs no cache and no coherence.
    scb.enable_icache();
    scb.enable_dcache(&mut cpuid);
    let mut board = Nucleo::start(&mut systick, &mut dcb, &mut dwt);
    let mut config = usart::Config::default();
    config.baudrate = BAUD;
    let uart = BufferedUart::new(
        peripherals.USART3,
        peripherals.PD9,
        peripherals.PD8,
        SENDING,
        RECEIVED,
        Interrupts,
        config,
    );
    let Ok(uart) = uart else { panic!("the line's rate is out of range") };
    let (mut port, mut line) = uart.split();
    let mut watchdog = IndependentWatchdog::new(peripherals.IWDG1, WATCHDOG_US);
    watchdog.unleash();
    let device = Device::in_place(DEVICE, ARRAYS);
    device.greet(last_run.count(), last_run.cause(), &board, &mut port);

    let mut bytes = [0; 256];
    loop {
        watchdog.pet();
        board.tick();
        // With interrupts masked none comes between the look and the sleep; a pending one ends the sleep all the same.
        let waiting = cortex_m::interrupt::free(|_| {
            let waiting = line.read_ready().unwrap_or(true);
            if !waiting {
                cortex_m::asm::wfi();
            }
            waiting
        });
        // A framing or noise error shows in the frame's checksum.
        let count = if waiting { line.read(&mut bytes).unwrap_or(0) } else { 0 };
        if device.receive(&bytes[..count], &board, &mut port) == Wish::Restart {
            let _ = port.flush();
            cortex_m::peripheral::SCB::sys_reset();
        }
    }
}
