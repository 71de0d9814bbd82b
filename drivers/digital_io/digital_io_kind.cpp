// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io_kind.h"

#include <algorithm>
#include <array>

namespace mpf {
namespace {

using enum DigitalIoKind::Driver;

constexpr std::uint32_t k24 = 0xffffff;
constexpr std::uint16_t kDriversOn = 4;  // bit of the control word of the optical models

// name, manufacturer, model, inputs, outputs, driver, interrupts, threshold, control
constexpr std::array kKinds{
    DigitalIoKind{"IP-Unidig-E", kGreenSpring, 0x51, k24, k24},
    DigitalIoKind{"IP-Unidig", kGreenSpring, 0x61, k24, k24},
    DigitalIoKind{"IP-Unidig-D", kGreenSpring, 0x62, k24, k24, switched},
    DigitalIoKind{"IP-Unidig-O-24IO", kGreenSpring, 0x63, k24, k24, openCollector, false, false,
                  kDriversOn},
    DigitalIoKind{"IP-Unidig-HV-16I8O", kGreenSpring, 0x64, 0xffff, 0xff0000, separate, false,
                  true},
    // its other 24 lines are not at these registers
    DigitalIoKind{"IP-Unidig-E48", kGreenSpring, 0x65, k24, k24},
    DigitalIoKind{"IP-Unidig-I-O-24I", kGreenSpring, 0x66, k24, 0, none, true},
    DigitalIoKind{"IP-Unidig-I-E", kGreenSpring, 0x67, k24, k24, openCollector, true},
    DigitalIoKind{"IP-Unidig-I", kGreenSpring, 0x68, k24, k24, openCollector, true},
    DigitalIoKind{"IP-Unidig-I-D", kGreenSpring, 0x69, k24, k24, switched, true},
    DigitalIoKind{"IP-Unidig-I-O-24IO", kGreenSpring, 0x6a, k24, k24, openCollector, true, false,
                  kDriversOn},
    DigitalIoKind{"IP-Unidig-I-HV-16I8O", kGreenSpring, 0x6b, 0xffff, 0xff0000, separate, true,
                  true},
    DigitalIoKind{"IP-Unidig-O-12I12O", kGreenSpring, 0x6f, 0xfff, 0xfff000, separate, false, false,
                  kDriversOn},
    DigitalIoKind{"IP-Unidig-I-O-12I12O", kGreenSpring, 0x70, 0xfff, 0xfff000, separate, true,
                  false, kDriversOn},
    DigitalIoKind{"IP-Unidig-O-24I", kGreenSpring, 0x73, k24, 0, none},
    DigitalIoKind{"IP-Unidig-HV-8I16O", kGreenSpring, 0x74, 0xff, 0xffff00, separate, false, true},
    DigitalIoKind{"IP-Unidig-I-HV-8I16O", kGreenSpring, 0x75, 0xff, 0xffff00, separate, true, true},
    DigitalIoKind{"DIO316I", kSystran, 0x63, 0xffff, 0xffffffff, separate},
};

}  // namespace

std::span<const DigitalIoKind> digitalIoKinds() noexcept { return kKinds; }

const DigitalIoKind* findDigitalIoKind(std::uint32_t manufacturer, std::uint16_t model) noexcept {
  const auto* const found = std::ranges::find_if(kKinds, [&](const DigitalIoKind& kind) {
    return kind.manufacturer == manufacturer && kind.model == model;
  });
  return found == kKinds.end() ? nullptr : found;
}

const DigitalIoKind* findDigitalIoKind(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kKinds, name, &DigitalIoKind::name);
  return found == kKinds.end() ? nullptr : found;
}

ModuleKind digitalIoModules() {
  ModuleKind modules{.name = "GreenSpring IP-Unidig or Systran DIO316I",
                     .manufacturer = kGreenSpring,
                     .models = {}};
  modules.others.push_back({.manufacturer = kSystran, .models = {}});
  for (const auto& kind : kKinds)
    (kind.isSystran() ? modules.others.front().models : modules.models).push_back(kind.model);
  return modules;
}

}  // namespace mpf
