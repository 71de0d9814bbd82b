// SPDX-License-Identifier: MIT
// Ip330Signal: the voltage at an input of Ip330Model as a function of time; reads signals from
// text.
//
//   "0=dc:1.5,1=sine:5:10,4=sine:50:1:2.5"      sine:FREQUENCY:AMPLITUDE[:OFFSET], in Hz and V
//
// Threads  a signal is called by the thread that makes the model convert, one call at a time for a
//          model.
#pragma once

#include <functional>
#include <map>
#include <string>

namespace mpf {

// Returns the voltage [V] at a time.
using Ip330Signal = std::function<double(double seconds)>;

[[nodiscard]] Ip330Signal dcSignal(double volts);
[[nodiscard]] Ip330Signal sineSignal(double hertz, double amplitude, double offset = 0);

// Creates a signal from its parameters, which are the text after the kind and the colon.
using Ip330SignalKind = std::function<Ip330Signal(const std::string& parameters)>;

// Reads signals; the result is indexed by channel. `others` are more kinds than dc and sine, by
// name, for example wires to other models.
//   throws  std::invalid_argument, which names the invalid part
[[nodiscard]] std::map<int, Ip330Signal> parseIp330Signals(
    const std::string& text, const std::map<std::string, Ip330SignalKind>& others = {});

}  // namespace mpf
