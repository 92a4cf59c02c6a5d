//! The co-processor: its library on this machine, its programs on emulated boards, and its clients, against the pipeline. One program, for
//! all of them have the whole pipeline in them.
mod bench;
mod client;
mod crashes_in_qemu;
mod device;
mod drive;
mod emulator;
mod hostile_line;
mod in_memory;
mod in_qemu;
mod promises;
mod states;
mod text;

#[cfg(unix)]
mod c_clients;
#[cfg(unix)]
mod on_stm32h7;
