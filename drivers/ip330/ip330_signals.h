// SPDX-License-Identifier: MIT
// Ip330Signal: what is on an input of the converter's model, in volts over time; and a text for several of them.
//
//   "0=dc:1.5,1=sine:5:10,4=sine:50:1:2.5"      sine:FREQUENCY:AMPLITUDE[:OFFSET], in Hz and V
//
// Threads  a signal is called by whoever makes the model convert, one call at a time for one model.
#pragma once

#include <functional>
#include <map>
#include <string>

namespace mpf {

using Ip330Signal = std::function<double(double seconds)>;

[[nodiscard]] Ip330Signal dcSignal(double volts);
[[nodiscard]] Ip330Signal sineSignal(double hertz, double amplitude, double offset = 0);

// Makes a signal from what stands behind the name of its kind and a colon.
using Ip330SignalKind = std::function<Ip330Signal(const std::string& parameters)>;

// Signals by channel. `others` are kinds beside dc and sine, by name: wires to other models, for one.
//   throws  std::invalid_argument that names what cannot be read
[[nodiscard]] std::map<int, Ip330Signal> parseIp330Signals(const std::string& text,
                                                           const std::map<std::string, Ip330SignalKind>& others = {});

}  // namespace mpf
