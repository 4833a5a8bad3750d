//! Pipes and sockets with a deadline.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::net::{SendFlags, send};
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::time::Instant;

/// No SIGPIPE if nobody reads any more; on Apple's systems this is a socket option.
#[cfg(not(target_vendor = "apple"))]
const SEND_FLAGS: SendFlags = SendFlags::NOSIGNAL;
#[cfg(target_vendor = "apple")]
const SEND_FLAGS: SendFlags = SendFlags::empty();

/// The reading end of a pipe, or the writing end of a socket. Both fail with
/// [`ErrorKind::TimedOut`] after the deadline.
///
/// Writing to a pipe that nobody reads any more ends a process that does not handle SIGPIPE, such
/// as a program in C; sending to a socket need not.
pub(super) struct TimedStream {
    file: File,
    pub(super) deadline: Instant,
}

impl TimedStream {
    pub(super) fn new(end: OwnedFd) -> Result<Self> {
        fcntl_setfl(&end, fcntl_getfl(&end)? | OFlags::NONBLOCK)?;
        Ok(Self {
            file: end.into(),
            deadline: Instant::now(),
        })
    }

    fn wait(&self, what: PollFlags) -> Result<()> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        let left = Timespec::try_from(left).map_err(|_| Error::from(ErrorKind::InvalidInput))?;
        match poll(&mut [PollFd::new(&self.file.as_fd(), what)], Some(&left)) {
            Ok(0) => Err(ErrorKind::TimedOut.into()),
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
            Err(e) => Err(e.into()),
        }
    }

    /// Acts as soon as that is possible.
    fn when_ready<T>(&self, what: PollFlags, mut act: impl FnMut(&File) -> Result<T>) -> Result<T> {
        loop {
            match act(&self.file) {
                Err(e) if would_block(&e) => self.wait(what)?,
                done => return done,
            }
        }
    }
}

fn would_block(e: &Error) -> bool {
    e.kind() == ErrorKind::WouldBlock
}

impl Read for TimedStream {
    fn read(&mut self, buf: &mut [u8]) -> Result<usize> {
        self.when_ready(PollFlags::IN, |mut file| file.read(buf))
    }
}

impl Write for TimedStream {
    fn write(&mut self, buf: &[u8]) -> Result<usize> {
        self.when_ready(PollFlags::OUT, |file| Ok(send(file, buf, SEND_FLAGS)?))
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::net::sockopt::set_socket_send_buffer_size;
    use std::os::unix::net::UnixStream;
    use std::time::Duration;

    #[test]
    fn an_empty_pipe_is_waited_for_and_not_for_ever() {
        let (reader, mut writer) = std::io::pipe().unwrap();
        let mut pipe = TimedStream::new(reader.into()).unwrap();
        pipe.deadline = Instant::now() + Duration::from_millis(20);
        assert_eq!(pipe.read(&mut [0]).unwrap_err().kind(), ErrorKind::TimedOut);
        writer.write_all(b"x").unwrap();
        let mut byte = [0];
        assert_eq!((pipe.read(&mut byte).unwrap(), byte), (1, *b"x"));
    }

    #[test]
    fn a_socket_that_nobody_reads_is_not_written_for_ever() {
        const BUFFER_BYTES: usize = 1 << 16;
        let (_reader, writer) = UnixStream::pair().unwrap();
        // The system's own buffer may hold any number of bytes.
        set_socket_send_buffer_size(&writer, BUFFER_BYTES).unwrap();
        let mut socket = TimedStream::new(writer.into()).unwrap();
        socket.deadline = Instant::now() + Duration::from_millis(20);
        let e = socket.write_all(&vec![0; 16 * BUFFER_BYTES]).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::TimedOut);
    }
}
