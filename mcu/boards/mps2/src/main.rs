//! The monorange co-processor on Arm's MPS2 boards, as QEMU emulates them: `mps2-an386` (Cortex-M4F) and
//! `mps2-an500` (Cortex-M7). One program; only the processor it is compiled for differs.
//!
//! | resource | use |
//! |---|---|
//! | UART 0 | the line; its receive interrupt moves bytes to the ring and does nothing else |
//! | timer 0 | 25 MHz, free running: time, and the cost of stages |
//! | SysTick | wakes the main loop ten times a second |
//! | watchdog | fed by the main loop only; 2 s |
//! | MPU region 0 | no access to the last KiB of the stack: an overflow is a fault, not a changed variable |
#![no_std]
#![no_main]

use core::mem::MaybeUninit;
use cortex_m_rt::entry;
use embedded_io::Write;
use monorange_cmsdk::{board::Mps2, uart};
use monorange_cortex::{fault, stack};
use monorange_mcu::{Arrays, Device, Mapper, Wish};

#[entry]
fn main() -> ! {
    // Made safe by `entry`, which runs once.
    static mut ARRAYS: Arrays = Arrays::new();
    static mut DEVICE: MaybeUninit<Device<Mapper>> = MaybeUninit::uninit();

    let last_run = fault::begin();
    let Some(cortex_m::Peripherals { SYST: mut systick, MPU: mpu, .. }) = cortex_m::Peripherals::take()
    else {
        panic!("the processor's peripherals are taken already");
    };
    stack::guard(&mpu);
    let mut board = Mps2::start(&mut systick);
    let mut port = uart::Port::start();
    let device = Device::in_place(DEVICE, ARRAYS);
    device.greet(last_run.count(), last_run.cause(), &board, &mut port);

    let mut bytes = [0; 256];
    loop {
        uart::sleep_until_frame();
        board.feed_watchdog();
        while let count @ 1.. = uart::RING.read(&mut bytes) {
            if device.receive(&bytes[..count], &board, &mut port) == Wish::Restart {
                let _ = port.flush();
                cortex_m::peripheral::SCB::sys_reset();
            }
        }
    }
}
