//! Clocks, time and cost.
use cortex_m::peripheral::{DCB, DWT, SYST, syst::SystClkSource};
use cortex_m_rt::exception;
use embassy_stm32::{Config, pac, rcc, time::Hertz};
use monorange_mcu::Board;
use monorange_protocol::message::CostUnit;

const CYCLES_PER_US: u32 = 480;
/// SysTick runs at an eighth of the core's clock from outside, or at all of it: its 24 bits hold 35 ms.
const WAKE_CYCLES: u32 = 30_000 * CYCLES_PER_US;

/// 8 MHz from the ST-LINK × 120 / 2 = 480 MHz for the core, 240 for the buses, 120 for the peripherals.
pub fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(rcc::Hse { freq: Hertz::mhz(8), mode: rcc::HseMode::Bypass });
    config.rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV1,
        mul: rcc::PllMul::MUL120,
        divp: Some(rcc::PllDiv::DIV2),
        divq: Some(rcc::PllDiv::DIV8),
        divr: None,
        fracn: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.voltage_scale = rcc::VoltageScale::Scale0;
    config.rcc.d1c_pre = rcc::AHBPrescaler::DIV1;
    config.rcc.ahb_pre = rcc::AHBPrescaler::DIV2;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb3_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb4_pre = rcc::APBPrescaler::DIV2;
    config
}

/// The board.
pub struct Nucleo {
    /// Cycles since the start, up to the last [`tick`](Self::tick).
    uptime: u64,
    last: u32,
}

impl Nucleo {
    /// Starts the counters.
    pub fn start(systick: &mut SYST, dcb: &mut DCB, dwt: &mut DWT) -> Self {
        dcb.enable_trace();
        DWT::unlock();
        dwt.set_cycle_count(0);
        dwt.enable_cycle_counter();
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(WAKE_CYCLES - 1);
        systick.clear_current();
        systick.enable_interrupt();
        systick.enable_counter();
        Self { uptime: 0, last: 0 }
    }

    /// Notes the time; at least every 8.9 s.
    pub fn tick(&mut self) {
        let now = DWT::cycle_count();
        self.uptime += u64::from(now.wrapping_sub(self.last));
        self.last = now;
    }
}

impl Board for Nucleo {
    const NAME: &'static str = "nucleo-h743zi2";
    const COST_UNIT: CostUnit = CostUnit::Cycles;

    fn cost(&self) -> u32 {
        DWT::cycle_count()
    }
    /// The serial interrupt belongs to the HAL: its cycles are in the stages that it interrupts.
    fn interrupt_cost(&self) -> u32 {
        0
    }
    fn units_from_ticks(ticks: u32) -> u32 {
        ticks
    }
    fn uptime_us(&self) -> u64 {
        (self.uptime + u64::from(DWT::cycle_count().wrapping_sub(self.last))) / u64::from(CYCLES_PER_US)
    }
    fn stack_used(&self) -> u32 {
        monorange_cortex::stack::used()
    }
    fn stack_size(&self) -> u32 {
        monorange_cortex::stack::size()
    }
    /// Not told by the HAL; gaps in the sequence show it.
    fn overrun(&self) -> u32 {
        0
    }
    fn alive(&self) {
        pac::IWDG1.kr().write(|key| key.set_key(pac::iwdg::vals::Key::RESET));
    }
}

/// Only wakes the main loop.
#[exception]
fn SysTick() {}
