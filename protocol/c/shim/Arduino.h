// So much of Arduino that a sketch runs on a computer: Serial1 is a Unix socket, Serial is the terminal.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>

unsigned long millis();

struct SocketSerial {
  void begin(unsigned long) {}
  int available();
  int read();
  size_t write(const uint8_t *bytes, size_t count);
};
struct TerminalSerial {
  void begin(unsigned long) {}
  void print(const char *text) { std::fputs(text, stdout); }
  void print(double number, int digits) { std::printf("%.*f", digits, number); }
  void println(const char *text) { std::puts(text); }
  void println(unsigned long number) { std::printf("%lu\n", number); }
};
extern SocketSerial Serial1;
extern TerminalSerial Serial;
