"""Waiting for real processes."""
import time

TIMEOUT_S = 120  # keeps a test from hanging


def wait_until(what, true, seconds=TIMEOUT_S):
    """The first true value of true(). After the time limit an AssertionError says what did not happen."""
    end = time.monotonic() + seconds
    while not (found := true()):
        if time.monotonic() > end:
            raise AssertionError(f"not within {seconds} s: {what}")
        time.sleep(0.05)
    return found
