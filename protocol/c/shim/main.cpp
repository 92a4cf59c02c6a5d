// Runs a sketch on a computer for some seconds: `program SOCKET SECONDS`.
#include "Arduino.h"
#include SKETCH
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int line = -1;
SocketSerial Serial1;
TerminalSerial Serial;

unsigned long millis() {
  using namespace std::chrono;
  return (unsigned long)duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count();
}
int SocketSerial::available() {
  pollfd ready = {line, POLLIN, 0};
  return poll(&ready, 1, 1) == 1;
}
int SocketSerial::read() {
  uint8_t byte;
  if (::read(line, &byte, 1) != 1) std::exit(3);
  return byte;
}
size_t SocketSerial::write(const uint8_t *bytes, size_t count) {
  if (::write(line, bytes, count) != (ssize_t)count) std::exit(3);
  return count;
}

int main(int count, char **arguments) {
  if (count != 3) return 2;
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, arguments[1], sizeof address.sun_path - 1);
  line = socket(AF_UNIX, SOCK_STREAM, 0);
  if (connect(line, (sockaddr *)&address, sizeof address)) return 2;
  setup();
  for (unsigned long end = millis() + 1000 * std::atol(arguments[2]); millis() < end;) loop();
  return 0;
}
