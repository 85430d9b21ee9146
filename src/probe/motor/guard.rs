//! Stops the motor in every case: on drop, and so on an early return or a panic, and on SIGINT, SIGTERM and SIGHUP.
//!
//! A process that is killed (SIGKILL), or whose machine fails, cannot do that. Then only the module's own watchdog stops the motor, see
//! [`super::tmcl::WATCHDOG`].

use super::port::{Answer, Port};
use super::table::MotorTable;
use super::tmcl::{LENGTH, Request, SUCCESS, command};
use super::{Fault, MotorError, Stopped};
use crate::files::signals::Held;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Interrupts the operation of a motor from any thread. It has the same effect as a signal to the process. All clones control the same motor.
#[derive(Clone, Debug, Default)]
pub struct Interrupter(Arc<AtomicBool>);

impl Interrupter {
    /// Ends the current operation with [`Fault::Interrupted`] before its next request, and stops the motor. All later operations end in the same
    /// way.
    pub fn interrupt(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    fn is_set(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// Passes all requests on to the module, and stops the motor when dropped if one of them may have set it in motion.
pub(crate) struct Guard {
    port: Port,
    address: u8,
    motor: u8,
    /// The motor may be in motion.
    moving: bool,
    /// The module may be searching its reference.
    searching: bool,
    held: Held,
    interrupter: Interrupter,
}

impl Guard {
    pub fn new(port: Port, table: &MotorTable) -> Guard {
        let (held, interrupter) = (Held::take(), Interrupter::default());
        Guard { port, address: table.address, motor: table.motor, moving: false, searching: false, held, interrupter }
    }

    /// Sends a request and waits for its reply. Requests that can be repeated without harm are tried up to three times, others once ([`Port::ask`]).
    ///
    /// # Errors
    /// [`Fault::NoReply`], [`Fault::Checksum`], [`Fault::Refused`], [`Fault::Unplugged`], and [`Fault::Interrupted`] once a signal has come or the
    /// [`Interrupter`] was used.
    pub fn ask(&mut self, request: &Request) -> Result<Answer, Fault> {
        self.interrupted()?;
        // Set before it is sent: a request without a reply may have been carried out.
        self.moving |= request.moves();
        self.searching |= request.moves() && request.command == command::REFERENCE_SEARCH;
        self.port.ask(request)
    }

    /// Sends a request whose reply of nine bytes has no checksum. Returns the bytes ([`Port::ask_raw`]).
    ///
    /// # Errors
    /// [`Fault::NoReply`], [`Fault::Unplugged`], and [`Fault::Interrupted`] once a signal has come or the [`Interrupter`] was used.
    pub(crate) fn ask_raw(&mut self, request: &Request) -> Result<[u8; LENGTH], Fault> {
        self.interrupted()?;
        self.port.ask_raw(request)
    }

    /// Checks whether the operation has to end.
    ///
    /// # Errors
    /// [`Fault::Interrupted`] once a signal has come or the [`Interrupter`] was used.
    pub fn interrupted(&self) -> Result<(), Fault> {
        match self.held.signal() {
            Some(signal) => Err(Fault::Interrupted(signal)),
            None if self.interrupter.is_set() => Err(Fault::Interrupted("the program")),
            None => Ok(()),
        }
    }

    pub(crate) fn interrupter(&self) -> &Interrupter {
        &self.interrupter
    }

    pub fn port(&self) -> &Port {
        &self.port
    }

    /// Notes that the motor has stopped by itself at its target, so that it need not be stopped.
    pub(crate) fn at_rest(&mut self) {
        (self.moving, self.searching) = (false, false);
    }

    /// Stops the motor and any reference search, also after a signal. Each command is sent up to three times until the module confirms it.
    pub fn stop(&mut self) -> Stopped {
        // Does not wait for the replies to earlier requests.
        self.port.hurry();
        let stop = Request::stop(self.address, self.motor);
        let mut reply = self.port.ask(&stop);
        if self.searching && !matches!(reply, Err(Fault::Unplugged(_))) {
            // Some modules continue a reference search after MST alone.
            reply = self.port.ask(&Request::search_stop(self.address, self.motor)).and_then(|_| self.port.ask(&stop));
        }
        match reply {
            Ok(_) => {
                (self.moving, self.searching) = (false, false);
                Stopped::Confirmed
            }
            Err(fault @ Fault::Unplugged(_)) => Stopped::Failed(why(&fault)),
            Err(fault) => Stopped::Unconfirmed(why(&fault)),
        }
    }

    /// Stops the motor after a fault of `operation`, unless the fault is [`Fault::OutOfRange`] and no earlier request may have left the motor in
    /// motion. Returns the fault, and whether the motor was stopped.
    pub fn fail(&mut self, operation: &'static str, fault: Fault) -> MotorError {
        // A motor that this program did not move is stopped, too: another program may have left it moving.
        let harmless = matches!(fault, Fault::OutOfRange(_)) && !self.moving;
        let stopped = if harmless { Stopped::NotMoved } else { self.stop() };
        // It was tried three times. Trying again on drop would only take longer.
        self.moving = false;
        MotorError { port: self.port.settings().path.clone(), operation, fault, stopped }
    }
}

/// A fault while stopping, without the advice.
fn why(fault: &Fault) -> String {
    match fault {
        Fault::NoReply { .. } => "it does not answer".into(),
        Fault::Checksum { .. } => "its answers are damaged".into(),
        Fault::Refused { request, status } if *status != SUCCESS => {
            format!("it answers {request} with status {status}")
        }
        Fault::Unplugged(error) => format!("the port is gone ({error})"),
        other => other.to_string(),
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        if self.moving {
            let stopped = self.stop();
            if stopped != Stopped::Confirmed {
                tracing::error!("{}: the motor is not known to have stopped: {stopped:?}", self.port.settings().path);
            }
        }
    }
}
