// How far is what stands on the floor at the middle of the picture? A monorange co-processor on Serial1, answers on Serial.
// Boards with 4 kB of RAM and a second serial port do: Teensy, Nano 33 BLE, Nano Every, ESP32, RP2040. Copy monorange.h beside this sketch.
#include "monorange.h"

static mo_client device;
static bool configured = false;
static uint32_t asked = 0, asked_at = 0, heard_at = 0;

static void write_line(void *, const uint8_t *bytes, size_t count) { Serial1.write(bytes, count); }

static void configure() {
  const mo_camera camera = {320, 240, {365, 365}, {160, 120}, 0, {0, 0, 0, 0, 0}};  // your calibration
  const mo_mount mount = {0.4, 0.2, 0, 0, 0, 0, {0.01, 0.017, 0.017, 0.017}};       // 0.4 m up, 0.2 rad down
  const mo_answers answers = {0, 0, 0};
  mo_configure(&device, &camera, &mount, 1, &answers, NULL, 0);
}

static void heard(uint8_t kind) {
  mo_info info;
  mo_ranged ranged;
  mo_fault fault;
  uint32_t request;
  uint8_t count;
  if (kind == MO_INFO && mo_read_info(&device, &info)) {
    configured = info.configured;
    if (!configured) configure();
  } else if (kind == MO_RANGES && mo_read_ranges(&device, &request, &count) && mo_next_ranged(&device, &ranged)) {
    Serial.print("range ");
    Serial.print(ranged.range, 4);
    Serial.print(" m, bearing ");
    Serial.print(ranged.bearing, 4);
    Serial.println(" rad");
  } else if (kind == MO_FAULT && mo_read_fault(&device, &fault)) {
    Serial.print("fault ");
    Serial.println(fault.cause);
  }
}

void setup() {
  Serial.begin(115200);
  Serial1.begin(921600);
  mo_init(&device, write_line, NULL);
  mo_hello(&device, 1);
}

void loop() {
  while (Serial1.available() > 0) {
    heard_at = millis();
    if (uint8_t kind = mo_receive(&device, Serial1.read())) heard(kind);
  }
  if (millis() - heard_at > 500) {  // a silence: the device may have restarted
    heard_at = millis();
    mo_hello(&device, 1);
  }
  if (configured && millis() - asked_at > 200) {
    const mo_spot spot = {0, {160, 200, 0, 0}};
    if (mo_range(&device, ++asked, 0.5, &spot, 1)) asked_at = millis();
  }
}
