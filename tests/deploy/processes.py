"""Programs in the background, whose crashes fail their test."""
import pathlib
import signal
import subprocess

from waiting import TIMEOUT_S

# Reports of faults in logs: of the programs, as in tests/support/process.cpp and tests/e2e/farm.mjs, and of a shell that runs one.
FAULTS_OF_PROGRAMS = ("WARNING: ThreadSanitizer", "ERROR: AddressSanitizer", "ERROR: LeakSanitizer", ": runtime error: ",
                      ": check failed: ", "terminate called")
FAULTS = (*FAULTS_OF_PROGRAMS, "Segmentation fault", "Bus error", "Aborted")


def expect_no_fault(log):
    text = pathlib.Path(log).read_text(errors="replace")
    for fault in FAULTS:
        if fault in text:
            raise AssertionError(f"{log} reports a fault: {text[text.index(fault):][:4000]}")


class BackgroundProgram(subprocess.Popen):
    """Its output goes to the file `log`."""

    def __init__(self, command, log, **more):
        self.log, self.sent = pathlib.Path(log), set()
        with self.log.open("a", encoding="utf-8") as out:
            super().__init__(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=out, stderr=out, **more)

    def send_signal(self, sig):
        if self.poll() is None:
            self.sent.add(sig)
            super().send_signal(sig)

    def end(self, sig=signal.SIGTERM):
        """Ends it with this signal. An AssertionError says that it crashed: another signal ended it, its exit code is not 0, or
        its log reports a fault."""
        self.send_signal(sig)
        try:
            code = self.wait(TIMEOUT_S)
        finally:
            self.kill()
            self.wait()
        expect_no_fault(self.log)
        if code > 0 or code < 0 and -code not in self.sent:
            raise AssertionError(f"{self.args[0]} ended with {code}:\n{self.log.read_text(errors='replace')[-4000:]}")
