//! `echolume stream --serve`: an OpenIGTLink server, and the messages about its clients.

use crate::args::check_number;
use crate::source::igtl::{self, Publisher, PublisherStatistics, SCHEME, ServerOptions, with_port};
use crate::terminal::{Failure, failed, input, remark, say};
use std::io::ErrorKind;
use std::time::Instant;

/// The address without a value, with the default port: other machines cannot reach it.
const LOOPBACK: &str = "igtl://127.0.0.1";

/// The arguments of an OpenIGTLink server.
#[derive(clap::Args)]
pub struct ServeArgs {
    /// Send pictures and whole volumes to OpenIGTLink clients such as 3D Slicer: igtl://HOST[:PORT]; port 0 takes a free one, 0.0.0.0 lets other
    /// machines in [without a value: igtl://127.0.0.1:18944]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = LOOPBACK)]
    serve: Option<String>,
    /// Distance between the voxels of the volumes that are sent, mm [default: those of a Cartesian volume; a sweep: 1]
    #[arg(long, value_name = "MM", requires = "serve")]
    serve_spacing: Option<f64>,
}

impl ServeArgs {
    /// Starts the server if one is requested, and prints its address.
    ///
    /// # Errors
    /// The address is not valid or cannot be opened (the port is in use, for example), or the spacing is not in 0.01..=1000 mm.
    pub fn start(&self) -> Result<Option<Serving>, Failure> {
        let Some(given) = &self.serve else { return Ok(None) };
        let place = given.strip_prefix(SCHEME).filter(|place| !place.is_empty());
        let Some(place) = place else {
            return Err(input(format!("--serve {given}: must read igtl://HOST or igtl://HOST:PORT")));
        };
        if igtl::port(place).is_none() {
            return Err(input(format!("--serve {given}: its port must lie in 0..=65535")));
        }
        let spacing = self.serve_spacing;
        check_number("--serve-spacing", spacing, |mm| (0.01..=1000.0).contains(&mm), "must lie in 0.01..=1000 mm")?;
        let publisher = Publisher::bind(&with_port(place), spacing, ServerOptions::default());
        let publisher = publisher.map_err(|error| {
            let why = match error.kind() {
                ErrorKind::AddrInUse => "the port is in use; give another one, or 0 for any".to_string(),
                ErrorKind::AddrNotAvailable => "no network of this machine has this address".to_string(),
                ErrorKind::PermissionDenied => "this user may not open the port; give one above 1023".to_string(),
                _ => error.to_string(),
            };
            failed(format!("--serve {given}: cannot be opened: {why}"))
        })?;
        let address = publisher.address();
        say!("serving: {SCHEME}{address}");
        if !address.ip().is_loopback() {
            let warning = "whoever reaches this machine can see the pictures; OpenIGTLink has no password";
            remark(&format!("--serve {given}: {warning}"));
        }
        Ok(Some(Serving { publisher, said: PublisherStatistics::default() }))
    }

    /// True if a server is requested.
    pub fn is_asked_for(&self) -> bool {
        self.serve.is_some()
    }
}

/// A running OpenIGTLink server, and the counts that were printed last.
pub struct Serving {
    pub publisher: Publisher,
    said: PublisherStatistics,
}

impl Serving {
    /// Prints all counts on one line, with the seconds since `began`, if since the last call a client connected, disconnected or was refused, or
    /// data was not sent because a client was slow or newer data came. Otherwise prints nothing. Logs a new fault of the server.
    pub fn say(&mut self, began: Instant) {
        let now = self.publisher.statistics();
        let (server, said) = (&now.server, &self.said.server);
        let is_news = (server.connections, server.clients, server.dropped, server.refused)
            != (said.connections, said.clients, said.dropped, said.refused);
        if is_news || now.replaced != self.said.replaced {
            say!("{:>6.1} s  serving: {}", began.elapsed().as_secs_f64(), line(&now));
        }
        if let Some(fault) = now.fault.as_ref().filter(|fault| self.said.fault.as_ref() != Some(fault)) {
            tracing::warn!("--serve: {fault}");
        }
        self.said = now;
    }

    /// Sends the waiting data, for [`ServerOptions::last`] at most, ends the connections, and prints the totals.
    pub fn end(self) {
        let statistics = self.publisher.finish();
        say!("served    {}", line(&statistics));
    }
}

fn line(now: &PublisherStatistics) -> String {
    let PublisherStatistics { server, pictures, volumes, replaced, .. } = now;
    let mut text = format!(
        "{} clients of {}, {pictures} pictures and {volumes} volumes, {} messages sent",
        server.clients, server.connections, server.sent
    );
    for (count, what) in [
        (server.dropped, "dropped for clients that read too slowly"),
        (*replaced, "replaced by newer ones before they were converted"),
        (server.disconnected, "clients disconnected that read nothing or spoke another protocol"),
        (server.refused, "clients refused, too many"),
    ] {
        if count > 0 {
            text += &format!(", {count} {what}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::igtl::PORT;

    /// The help states the address that `--serve` takes without a value.
    #[test]
    fn without_a_value_the_server_is_of_this_machine_at_the_usual_port() {
        let place = LOOPBACK.strip_prefix(SCHEME).expect("an address");
        assert_eq!(with_port(place), format!("127.0.0.1:{PORT}"));
        let command = <ServeArgs as clap::Args>::augment_args(clap::Command::new("stream"));
        let help = command.get_arguments().find(|arg| arg.get_id() == "serve").and_then(|arg| arg.get_help());
        let stated = format!("[without a value: {SCHEME}{}]", with_port(place));
        assert!(help.is_some_and(|help| help.to_string().contains(&stated)), "{help:?}");
    }
}
