// SPDX-License-Identifier: MIT
#include "picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

namespace mpf::demo {
namespace {

using Style = tools::TopLine::Style;

constexpr std::size_t kMostSamples = 1000;
constexpr double kFullVolts = 5;
constexpr std::array kBars{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr double kBarVolts = 2.5;

std::string voltsText(const std::optional<double>& volts) {
  return volts ? fmt::format("{:+7.4f} V", *volts) : "no answer";
}

// Bit 0 is on the right.
std::string lamps(const std::optional<std::uint8_t>& bits, const char* on, const char* off) {
  if (!bits) return "no answer";
  std::string text;
  for (int bit = 7; bit >= 0; --bit) text += ((*bits >> bit) & 1) != 0 ? on : off;
  return text;
}

std::size_t rowOf(double volts, std::size_t rows) {
  const auto share = std::clamp((kFullVolts - volts) / (2 * kFullVolts), 0.0, 1.0);
  return std::min(static_cast<std::size_t>(share * static_cast<double>(rows)), rows - 1);
}

}  // namespace

void Picture::add(const Sample& sample) {
  samples_.push_back(sample);
  if (samples_.size() > kMostSamples) samples_.pop_front();
}

std::vector<std::string> Picture::chart(std::size_t rows, std::size_t columns) const {
  std::vector<std::vector<const char*>> cells(rows, std::vector<const char*>(columns, " "));
  const auto shown = std::min(samples_.size(), columns);
  for (std::size_t column = 0; column < shown; ++column) {
    const auto& sample = samples_[samples_.size() - shown + column];
    if (sample.written) cells[rowOf(*sample.written, rows)][column] = "·";
    if (sample.measured) cells[rowOf(*sample.measured, rows)][column] = "●";
  }
  std::vector<std::string> lines;
  for (std::size_t row = 0; row < rows; ++row) {
    const auto top =
        kFullVolts - 2 * kFullVolts * static_cast<double>(row) / static_cast<double>(rows);
    std::string text = row == 0 || row == rows / 2 ? fmt::format("{:+3.0f} V │", top) : "      │";
    for (const auto* const cell : cells[row]) text += cell;
    lines.push_back(text);
  }
  return lines;
}

std::string Picture::bars(std::size_t columns) const {
  std::string text;
  const auto shown = std::min(samples_.size(), columns);
  for (std::size_t at = samples_.size() - shown; at < samples_.size(); ++at) {
    const auto& volts = samples_[at].instrument;
    const auto share = volts ? std::clamp((*volts + kBarVolts) / (2 * kBarVolts), 0.0, 1.0) : 0;
    text += volts ? kBars[1 + static_cast<std::size_t>(std::lround(share * 7))] : kBars[0];
  }
  return text;
}

std::vector<tools::TopLine> Picture::lines(int rows, int columns, std::uint64_t changes) const {
  constexpr int kOtherRows = 9;
  const auto& last = samples_.back();
  const auto width = static_cast<std::size_t>(std::max(columns - 7, 10));
  std::vector<tools::TopLine> lines{
      {"MPF: four servers, each in a process of its own; this is a client of all four",
       Style::title},
      {"", Style::plain},
      {fmt::format("DAC channel 0 · {}   ── a wire ──►   ADC channel 0 ● {}",
                   voltsText(last.written), voltsText(last.measured)),
       Style::heading}};
  for (auto& text : chart(static_cast<std::size_t>(std::clamp(rows - kOtherRows, 4, 21)), width))
    lines.push_back({std::move(text), Style::plain});
  lines.push_back({fmt::format("digital lines 15..8  {}  outputs", lamps(last.outputs, "● ", "○ ")),
                   Style::plain});
  lines.push_back({fmt::format("               7..0  {}  inputs, wired to them: {} changes",
                               lamps(last.inputs, "● ", "○ "), changes),
                   Style::plain});
  lines.push_back({fmt::format("a voltmeter on a serial line  {}", voltsText(last.instrument)),
                   Style::heading});
  lines.push_back({"      " + bars(width), Style::plain});
  lines.push_back({"q quit", Style::keys});
  return lines;
}

std::string Picture::line(std::uint64_t changes) const {
  const auto& last = samples_.back();
  return fmt::format("DAC {}  ADC {}  outputs {}  inputs {}  changes {:4}  voltmeter {}",
                     voltsText(last.written), voltsText(last.measured),
                     lamps(last.outputs, "1", "0"), lamps(last.inputs, "1", "0"), changes,
                     voltsText(last.instrument));
}

}  // namespace mpf::demo
