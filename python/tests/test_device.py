import socket
import threading

import pytest

import monorange


def test_a_device_that_says_nothing_is_named():
    ours, theirs = socket.socketpair()
    finder = monorange.RangeFinder([[365.0, 0, 160], [0, 365, 120], [0, 0, 1]], size=(320, 240), height=0.4, tilt=0.2)
    sink = threading.Thread(target=lambda: [None for _ in iter(lambda: theirs.recv(4096), b"")])
    sink.start()
    with pytest.raises(TimeoutError, match="does not answer"):
        monorange.Device(ours, finder, patience=0.3)
    ours.close()
    sink.join()


def test_a_line_that_closes_is_a_connection_error():
    ours, theirs = socket.socketpair()
    theirs.close()
    finder = monorange.RangeFinder([[365.0, 0, 160], [0, 365, 120], [0, 0, 1]], size=(320, 240), height=0.4, tilt=0.2)
    with pytest.raises(ConnectionError):
        monorange.Device(ours, finder, patience=0.5)
