// SPDX-License-Identifier: MIT
// Picture: the last rounds of the demo as lines of text: a chart of DAC and ADC, lamps for the
// digital lines, a chart of the instrument.
//
// Threads  one.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "devices.h"
#include "tools/report/top_view.h"

namespace mpf::demo {

class Picture {
 public:
  void add(const Sample& sample);
  // The picture for a screen of this size.
  [[nodiscard]] std::vector<tools::TopLine> lines(int rows, int columns,
                                                  std::uint64_t changes) const;
  // The last round as one line.
  [[nodiscard]] std::string line(std::uint64_t changes) const;

 private:
  [[nodiscard]] std::vector<std::string> chart(std::size_t rows, std::size_t columns) const;
  [[nodiscard]] std::string bars(std::size_t columns) const;

  std::deque<Sample> samples_;  // oldest first
};

}  // namespace mpf::demo
