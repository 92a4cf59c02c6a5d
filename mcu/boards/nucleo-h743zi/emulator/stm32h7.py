"""An STM32H743 as far as this firmware looks at it, on unicorn's Cortex-M7: `stm32h7.py ELF SOCKET`.

The board's own program runs unchanged, from its reset vector on. USART 3 is the Unix socket, for one client; clocks, flash and power
say that they are ready at once; the interrupt controller knows USART 3. What the program sets is printed as `name 0xvalue` when it first
sleeps. Not emulated: time (DWT counts this machine's), caches, the watchdog's bite.
"""

import collections
import os
import select
import socket
import struct
import sys
import time

from unicorn import UC_ARCH_ARM, UC_HOOK_INSN_INVALID, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import (
    UC_ARM_REG_PC,
    UC_ARM_REG_PRIMASK,
    UC_ARM_REG_R4,
    UC_ARM_REG_R5,
    UC_ARM_REG_SP,
    UC_ARM_REG_XPSR,
    UC_CPU_ARM_CORTEX_M7,
)

import double

FLASH, RAM, TRAP = 0x0800_0000, 0x2000_0000, 0x0900_0000
RCC, PWR, FLASH_CONTROL, USART3, IWDG1 = 0x5802_4400, 0x5802_4800, 0x5200_2000, 0x4000_4800, 0x5800_4800
CR1, ISR, RDR, TDR = USART3, USART3 + 0x1C, USART3 + 0x24, USART3 + 0x28
RXNE, TXE, TC, READY = 1 << 5, 1 << 7, 1 << 6, 3 << 21
DWT_CYCCNT, SET_ENABLE, CLEAR_ENABLE, SET_PENDING = 0xE000_1004, 0xE000_E100, 0xE000_E180, 0xE000_E200
CCR, AIRCR, CCSIDR, MPU_CTRL = 0xE000_ED14, 0xE000_ED0C, 0xE000_ED80, 0xE000_ED94
# Its number, and where its bit stands in the interrupt controller's registers.
IRQ = 39
IRQ_WORD, IRQ_BIT = 4 * (IRQ // 32), 1 << IRQ % 32
WFI = b"\x30\xbf"
# In place of the processor's own way to and from a handler: blx r4; ldr r0, [r5]; cmp r0, #0; bne back; and the end of a run.
CALLER, DUE = TRAP + 0x100, 0x5100_0000
CALL_WHILE_DUE = struct.pack("<4H", 0x47A0, 0x6828, 0x2800, 0xD1FB)
# Instructions after which an interrupt that is due comes at the latest.
SLICE = 20_000
# Bytes that are put on the line between two sleeps: the receive buffer, which is empty then, holds twice as many.
AT_ONCE = 2048
SHOWN = {
    "caches": CCR,
    "mpu": MPU_CTRL,
    "flash": FLASH_CONTROL,
    "pll1": RCC + 0x30,
    "clocks": RCC + 0x18,
    "baud": USART3 + 0x0C,
}
# Registers whose ready bits follow from what was set: of each switch, how far on its answer stands.
READY_AFTER = {
    RCC: {0: 2, 7: 1, 12: 1, 16: 1, 24: 1, 26: 1, 28: 1},
    RCC + 0x70: {0: 1},
    RCC + 0x74: {0: 1},
}
ALWAYS_READY = {RCC: 3 << 14, PWR + 0x04: 7 << 13, PWR + 0x18: 1 << 13, CCSIDR: 0x7007_E019}


class Chip:
    def __init__(self, elf):
        self.cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.cpu.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M7)
        for place, size in [(FLASH, 2 << 20), (RAM, 128 << 10), (TRAP, 4096)]:
            self.cpu.mem_map(place, size)
        self.cpu.mem_write(CALLER, CALL_WHILE_DUE)
        load(self.cpu, elf)
        for base in [0x4000_0000, 0x4800_0000, 0x5100_0000, 0x5200_0000, 0x5800_0000, 0x5C00_0000, 0xE000_0000]:
            self.cpu.mmio_map(base, 1 << 20, self.read, base, self.write, base)
        self.cpu.hook_add(UC_HOOK_INSN_INVALID, double.execute)
        self.line, self.sent = collections.deque(), bytearray()
        self.fed = 0
        self.reset()

    def reset(self):
        """As by the reset pin: RAM keeps what it has."""
        self.registers, self.enabled, self.pending, self.restart = {}, False, False, False
        stack, start = struct.unpack("<2I", self.cpu.mem_read(FLASH, 8))
        self.handler = struct.unpack("<I", self.cpu.mem_read(FLASH + 4 * (16 + IRQ), 4))[0]
        self.cpu.reg_write(UC_ARM_REG_SP, stack)
        self.cpu.reg_write(UC_ARM_REG_XPSR, 1 << 24)
        self.pc = start

    def read(self, _cpu, offset, size, base):
        address = (base + offset) & ~3
        if address == ISR:
            return TXE | TC | READY | (RXNE if self.line else 0)
        if address == DUE:
            return 1 if self.due() else 0
        value = self.registers.get(address, 0) | ALWAYS_READY.get(address, 0)
        for bit, on in READY_AFTER.get(address, {}).items():
            value |= (value >> bit & 1) << (bit + on)
        if address == RCC + 0x10:  # the clock that is used is the one that was chosen
            value = value & ~0x38 | (value & 7) << 3
        elif address == RDR:
            value = self.line.popleft() if self.line else 0
        elif address == DWT_CYCCNT:
            value = int(time.perf_counter() * 480e6)
        return value >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def write(self, _cpu, offset, size, value, base):
        address, shift = (base + offset) & ~3, 8 * (offset & 3)
        mask = (1 << 8 * size) - 1 << shift
        whole = self.registers.get(address, 0) & ~mask | value << shift & mask
        self.registers[address] = whole
        if address == TDR:
            self.sent.append(value & 0xFF)
        elif address == SET_ENABLE + IRQ_WORD and whole & IRQ_BIT:
            self.enabled = True
        elif address == CLEAR_ENABLE + IRQ_WORD and whole & IRQ_BIT:
            self.enabled = False
        elif address == SET_PENDING + IRQ_WORD and whole & IRQ_BIT:
            self.pending = True
        elif address == AIRCR and whole >> 16 == 0x05FA and whole & 4:
            self.restart = True
        elif address == IWDG1 and value == 0xAAAA:
            self.fed += 1

    def run(self):
        """Runs until the program sleeps, or a slice is over; returns whether it sleeps. Interrupts may come then."""
        self.cpu.emu_start(self.pc | 1, TRAP, count=SLICE)
        self.pc = self.cpu.reg_read(UC_ARM_REG_PC)
        asleep = bytes(self.cpu.mem_read(self.pc - 2, 2)) == WFI
        while self.cpu.reg_read(UC_ARM_REG_PRIMASK) & 1 and not self.restart:
            self.cpu.emu_start(self.pc | 1, TRAP, count=1)
            self.pc = self.cpu.reg_read(UC_ARM_REG_PC)
        return asleep

    def due(self):
        """Whether the handler is to be called; a wish for that is then granted."""
        if not self.enabled:
            return False
        pending, self.pending = self.pending, False
        wanted = self.registers.get(CR1, 0)
        return pending or wanted & TXE or (self.line and wanted & RXNE)

    def interrupts(self):
        """Calls the interrupt handler as long as it has work; the program finds its registers as they were."""
        if not self.due():
            return
        before = self.cpu.context_save()
        self.cpu.reg_write(UC_ARM_REG_SP, (self.cpu.reg_read(UC_ARM_REG_SP) - 104) & ~7)
        self.cpu.reg_write(UC_ARM_REG_R4, self.handler)
        self.cpu.reg_write(UC_ARM_REG_R5, DUE)
        self.cpu.emu_start(CALLER | 1, CALLER + len(CALL_WHILE_DUE))
        self.cpu.context_restore(before)


def load(cpu, elf):
    with open(elf, "rb") as file:
        data = file.read()
    (first,), (count,) = struct.unpack_from("<I", data, 28), struct.unpack_from("<H", data, 44)
    for number in range(count):
        kind, offset, _, place, size = struct.unpack_from("<5I", data, first + 32 * number)
        if kind == 1 and size:
            cpu.mem_write(place, data[offset : offset + size])


def serve(chip, line):
    """Carries bytes between the line and the chip until the other end has gone."""
    shown = False
    while True:
        asleep = chip.run()
        if chip.restart:
            chip.reset()
            continue
        if asleep and not shown:
            print(*(f"{name} {chip.registers.get(place, 0):#x}" for name, place in SHOWN.items()), flush=True)
            shown = True
        if asleep:
            # The timer wakes the program every 30 ms.
            if select.select([line], [], [], 0.03)[0]:
                came = line.recv(AT_ONCE)
                if not came:
                    return
                chip.line.extend(came)
        chip.interrupts()
        if chip.sent:
            line.sendall(chip.sent)
            chip.sent.clear()


def main():
    elf, place = sys.argv[1:]
    chip = Chip(elf)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(place)
        listener.listen(1)
        try:
            line, _ = listener.accept()
            serve(chip, line)
        except (ConnectionError, UcError) as error:
            print(f"stopped at {chip.cpu.reg_read(UC_ARM_REG_PC):#x}: {error}", flush=True)
        finally:
            os.unlink(place)
    print(f"fed {chip.fed}", flush=True)


if __name__ == "__main__":
    main()
