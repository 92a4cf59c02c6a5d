use clap::Args;
use std::{
    fmt,
    io::{self, Read, Write},
    net::TcpStream,
    path::PathBuf,
    time::Duration,
};

/// Of a serial port that is named without one.
const BAUD: u32 = 921_600;
/// How long a read waits for bytes.
const READ_TIMEOUT: Duration = Duration::from_millis(5);

/// Where the device is.
#[derive(Args, Clone, Debug)]
#[group(required = true, multiple = false)]
pub(super) struct Line {
    /// A serial port: /dev/ttyACM0, COM3, with @BAUD if it is not 921600.
    #[arg(long, value_name = "DEV[@BAUD]")]
    port: Option<String>,
    /// A TCP socket.
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// A Unix socket.
    #[arg(long, value_name = "PATH")]
    unix: Option<PathBuf>,
}

/// Both directions of an open line.
pub(super) trait Stream: Read + Write {}
impl<S: Read + Write> Stream for S {}

impl Line {
    /// Opens it.
    pub(super) fn open(&self) -> io::Result<Box<dyn Stream>> {
        if let Some(port) = &self.port {
            let (device, baud) = match port.rsplit_once('@') {
                Some((device, baud)) => {
                    (device, baud.parse().map_err(|_| invalid("the baud rate is no number"))?)
                }
                None => (port.as_str(), BAUD),
            };
            return Ok(Box::new(serialport::new(device, baud).timeout(READ_TIMEOUT).open()?));
        }
        if let Some(address) = &self.tcp {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(READ_TIMEOUT))?;
            return Ok(Box::new(stream));
        }
        self.open_unix()
    }

    #[cfg(unix)]
    fn open_unix(&self) -> io::Result<Box<dyn Stream>> {
        let path = self.unix.as_ref().ok_or_else(|| invalid("no line is named"))?;
        let stream = std::os::unix::net::UnixStream::connect(path)?;
        stream.set_read_timeout(Some(READ_TIMEOUT))?;
        Ok(Box::new(stream))
    }

    #[cfg(not(unix))]
    fn open_unix(&self) -> io::Result<Box<dyn Stream>> {
        Err(invalid("this system has no Unix sockets"))
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.port, &self.tcp, &self.unix) {
            (Some(name), _, _) | (_, Some(name), _) => f.write_str(name),
            (_, _, Some(path)) => path.display().fmt(f),
            _ => f.write_str("no line"),
        }
    }
}

fn invalid(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}
