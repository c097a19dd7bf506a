//! Clocks, pins and peripherals.

use cortex_m::peripheral::NVIC;
use stm32h7xx_hal::gpio::{Input, Pin};
use stm32h7xx_hal::independent_watchdog::IndependentWatchdog;
use stm32h7xx_hal::pac::{self, interrupt};
use stm32h7xx_hal::prelude::*;
use stm32h7xx_hal::rcc::ResetReason;

use crate::camera::Camera;
use crate::line::Line;
use crate::parameters::Parameters;

/// The parts of the board.
pub(crate) struct Parts {
    pub(crate) camera: Camera,
    pub(crate) line: Line,
    pub(crate) parameters: Parameters,
    pub(crate) watchdog: IndependentWatchdog,
    /// The line of the lift-off plug: high when it is pulled.
    pub(crate) lift_off: Pin<'E', 2, Input>,
    /// The warning that power will be cut: low.
    pub(crate) power_good: Pin<'E', 3, Input>,
    pub(crate) backup: pac::RTC,
    /// Whether the watchdog, or a panic, caused the last reset.
    pub(crate) was_reset: bool,
}

/// Starts the board. Returns `None` the second time.
pub(crate) fn start() -> Option<Parts> {
    let (mut core, device) = (cortex_m::Peripherals::take()?, pac::Peripherals::take()?);
    // Only the program is cached. With a data cache the picture would have to be invalidated before it is read.
    core.SCB.enable_icache();

    // The peripherals that the library does not know.
    device.RCC.ahb2enr.modify(|_, w| w.dcmien().set_bit());
    device.RCC.ahb1enr.modify(|_, w| w.dma1en().set_bit());
    device.RCC.apb4enr.modify(|_, w| w.rtcapben().set_bit());

    let mut power = device.PWR.constrain().freeze();
    // Makes the backup registers writable.
    let _ = power.backup();
    let mut clock_control = device.RCC.constrain();
    let reason = clock_control.get_reset_reason();
    let clocks = clock_control.sys_ck(400.MHz()).pclk1(100.MHz()).freeze(power, &device.SYSCFG);
    let peripherals = clocks.peripheral;

    let port_a = device.GPIOA.split(peripherals.GPIOA);
    let port_b = device.GPIOB.split(peripherals.GPIOB);
    let port_c = device.GPIOC.split(peripherals.GPIOC);
    let port_d = device.GPIOD.split(peripherals.GPIOD);
    let port_e = device.GPIOE.split(peripherals.GPIOE);
    // HSYNC, PIXCLK, VSYNC, and the data lines 0 to 7.
    let _ = port_a.pa4.into_alternate::<13>();
    let _ = port_a.pa6.into_alternate::<13>();
    let _ = port_b.pb7.into_alternate::<13>();
    let _ = port_c.pc6.into_alternate::<13>();
    let _ = port_c.pc7.into_alternate::<13>();
    let _ = port_c.pc8.into_alternate::<13>();
    let _ = port_c.pc9.into_alternate::<13>();
    let _ = port_c.pc11.into_alternate::<13>();
    let _ = port_d.pd3.into_alternate::<13>();
    let _ = port_b.pb8.into_alternate::<13>();
    let _ = port_b.pb9.into_alternate::<13>();
    let pins = (port_d.pd8.into_alternate::<7>(), port_d.pd9.into_alternate::<7>());
    let serial = device.USART3.serial(pins, 115_200.bps(), peripherals.USART3, &clocks.clocks).ok()?;
    let timer = device.TIM2.tick_timer(1.MHz(), peripherals.TIM2, &clocks.clocks);

    let parts = Parts {
        camera: Camera::start(device.DCMI, device.DMA1, &device.DMAMUX1, timer),
        line: Line::start(serial),
        parameters: Parameters::new(device.FLASH)?,
        watchdog: IndependentWatchdog::new(device.IWDG),
        lift_off: port_e.pe2.into_pull_up_input(),
        power_good: port_e.pe3.into_pull_up_input(),
        backup: device.RTC,
        was_reset: matches!(
            reason,
            ResetReason::IndependentWatchdogReset | ResetReason::GenericWatchdogReset | ResetReason::SystemReset
        ),
    };
    // SAFETY: the handlers of these interrupts share only atomics and critical sections with the program.
    unsafe {
        NVIC::unmask(interrupt::DCMI);
        NVIC::unmask(interrupt::USART3);
    }
    Some(parts)
}
