// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_lines.h"

#include <array>
#include <utility>

namespace mpf {

std::string namesOfLines(std::uint8_t control) {
  static constexpr std::array<std::pair<gpib_line::Line, const char*>, 8> kNames{
      {{gpib_line::kAtn, "ATN"},
       {gpib_line::kDav, "DAV"},
       {gpib_line::kNrfd, "NRFD"},
       {gpib_line::kNdac, "NDAC"},
       {gpib_line::kEoi, "EOI"},
       {gpib_line::kSrq, "SRQ"},
       {gpib_line::kIfc, "IFC"},
       {gpib_line::kRen, "REN"}}};
  std::string names;
  for (const auto& [line, name] : kNames) {
    if ((control & line) != 0) names.append(names.empty() ? "" : " ").append(name);
  }
  return names.empty() ? "none" : names;
}

}  // namespace mpf
