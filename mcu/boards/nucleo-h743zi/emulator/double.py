"""Double precision for unicorn's Cortex-M7, which refuses what the STM32H743's has (Arm DDI 0403, A7.7.220 to A7.7.254).

Python's floats are IEEE 754 doubles, rounded to nearest, as the processor's are; products and sums are rounded apart.
"""

import math
import struct

from unicorn.arm_const import UC_ARM_REG_D0, UC_ARM_REG_FPSCR, UC_ARM_REG_PC, UC_ARM_REG_S0, UC_ARM_REG_XPSR

SIGN = 1 << 63


def bits_from(value):
    return struct.unpack("<Q", struct.pack("<d", value))[0]


def value_from(bits):
    return struct.unpack("<d", struct.pack("<Q", bits))[0]


def quotient(a, b):
    if b != 0 or math.isnan(a):
        return a / b if b != 0 else math.nan
    return math.nan if a == 0 else math.copysign(math.inf, a) * math.copysign(1.0, b)


def extreme(a, b, least):
    """The lesser or the greater; of a number and none, the number; -0 is less than 0."""
    if math.isnan(a) or math.isnan(b):
        return b if math.isnan(a) else a
    low, high = sorted([a, b], key=lambda value: (value, math.copysign(1.0, value)))
    return low if least else high


def single_from(value):
    """Bits of the nearest single; beyond the largest it is infinite."""
    try:
        return struct.unpack("<I", struct.pack("<f", value))[0]
    except OverflowError:
        return 0x7F80_0000 | (0x8000_0000 if value < 0 else 0)


def whole_from(value, least, most):
    """Towards zero, saturated; no number is 0."""
    if math.isnan(value):
        return 0
    return int(max(least, min(most, math.trunc(value) if math.isfinite(value) else math.copysign(2.0**40, value))))


ARITHMETIC = {
    (0, 0): lambda d, a, b: d + a * b,
    (0, 1): lambda d, a, b: d - a * b,
    (1, 0): lambda d, a, b: a * b - d,
    (1, 1): lambda d, a, b: -d - a * b,
    (2, 0): lambda d, a, b: a * b,
    (2, 1): lambda d, a, b: -(a * b),
    (3, 0): lambda d, a, b: a + b,
    (3, 1): lambda d, a, b: a - b,
    (4, 0): lambda d, a, b: quotient(a, b),
}


def execute(cpu, _data):
    """Executes the instruction that was refused, where it is one of these; returns whether it was."""
    place = cpu.reg_read(UC_ARM_REG_PC) & ~1
    high, low = struct.unpack("<2H", cpu.mem_read(place, 4))
    word = high << 16 | low
    double = word >> 8 & 1
    if word >> 24 & 0xF != 0xE or word >> 9 & 7 != 5:
        return False
    to = (word >> 22 & 1) << 4 | word >> 12 & 15
    left = (word >> 7 & 1) << 4 | word >> 16 & 15
    right = (word >> 5 & 1) << 4 | word & 15
    single_to, single_right = (word >> 12 & 15) << 1 | word >> 22 & 1, (word & 15) << 1 | word >> 5 & 1

    def bits(register):
        return cpu.reg_read(UC_ARM_REG_D0 + register) & (1 << 64) - 1

    def put(register, value):
        cpu.reg_write(UC_ARM_REG_D0 + register, value)

    def put_single(value):
        cpu.reg_write(UC_ARM_REG_S0 + single_to, value & 0xFFFF_FFFF)

    def single():
        return cpu.reg_read(UC_ARM_REG_S0 + single_right) & 0xFFFF_FFFF

    def skip():
        cpu.reg_write(UC_ARM_REG_PC, place + 4 | 1)
        return True

    kind, second = (word >> 23 & 1) << 2 | word >> 20 & 3, word >> 6 & 1
    function, third = word >> 16 & 15, word >> 7 & 1
    if word >> 28 == 0xF:
        if kind == 4:
            put(to, bits_from(extreme(value_from(bits(left)), value_from(bits(right)), least=second)))
            return skip()
        if kind > 4:
            return False
        flags = cpu.reg_read(UC_ARM_REG_XPSR)
        n, z, v = flags >> 31 & 1, flags >> 30 & 1, flags >> 28 & 1
        holds = [z, v, n == v, not z and n == v][kind]
        put(to, bits(left if holds else right))
    elif (kind, second) in ARITHMETIC:
        d, a, b = (value_from(bits(register)) for register in (to, left, right))
        put(to, bits_from(ARITHMETIC[kind, second](d, a, b)))
    elif kind != 7:
        return False
    elif not second:  # a constant
        sign, exponent = word >> 19 & 1, word >> 18 & 1
        top = (exponent ^ 1) << 10 | (0xFF if exponent else 0) << 2 | word >> 16 & 3
        put(to, sign << 63 | top << 52 | (word & 15) << 48)
    elif function == 0:
        put(to, bits(right) & ~SIGN if third else bits(right))
    elif function == 1 and not third:
        put(to, bits(right) ^ SIGN)
    elif function == 1:
        value = value_from(bits(right))
        put(to, bits_from(math.sqrt(value) if value >= 0 else math.nan))
    elif function in (4, 5):
        a, b = value_from(bits(to)), 0.0 if function == 5 else value_from(bits(right))
        flags = 3 if math.isnan(a) or math.isnan(b) else 6 if a == b else 8 if a < b else 2
        cpu.reg_write(UC_ARM_REG_FPSCR, cpu.reg_read(UC_ARM_REG_FPSCR) & 0x0FFF_FFFF | flags << 28)
    elif function == 7 and third and double:
        put_single(single_from(value_from(bits(right))))
    elif function == 7 and third:
        put(to, bits_from(struct.unpack("<f", struct.pack("<I", single()))[0]))
    elif function == 8:
        value = single()
        put(to, bits_from(float(value - (1 << 32) if third and value >> 31 else value)))
    elif function == 12 and third:
        put_single(whole_from(value_from(bits(right)), 0, (1 << 32) - 1))
    elif function == 13 and third:
        put_single(whole_from(value_from(bits(right)), -(1 << 31), (1 << 31) - 1))
    else:
        return False
    return skip()
