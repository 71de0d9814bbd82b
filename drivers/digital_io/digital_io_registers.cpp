// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io_registers.h"

namespace mpf {

namespace word = digital_io_word;

void DigitalIoRegisters::setUp(int threshold) {
  if (kind_.isSystran()) {
    writeWord(word::kSystranEnable, readWord(word::kSystranEnable) | word::kSystranPorts);
    writeWord(word::kSystranDirection, readWord(word::kSystranDirection) | word::kSystranPortsOut);
    return;
  }
  if (kind_.controlBits != 0)
    writeWord(word::kControl, readWord(word::kControl) | kind_.controlBits);
  if (kind_.hasThreshold) writeWord(word::kThreshold, static_cast<std::uint16_t>(threshold));
}

}  // namespace mpf
