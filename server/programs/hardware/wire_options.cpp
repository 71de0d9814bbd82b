// SPDX-License-Identifier: MIT
#include "server/programs/hardware/wire_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <vector>

#include "base/number.h"

namespace mpf {

void InputWires::addTo(CLI::App& app, int highest) {
  app.add_option_function<std::vector<std::string>>(
         "--input",
         [this, highest](const std::vector<std::string>& texts) {
           for (const auto& text : texts) add(text, highest);
         },
         "Connects an input of a model to a wire, BIT=WIRE; may be repeated")
      ->allow_extra_args(false)
      ->needs("--wires")
      ->type_name("BIT=WIRE");
}

void InputWires::add(const std::string& text, int highest) {
  const auto equals = text.find('=');
  const auto bit = tryNumber<int>(std::string_view(text).substr(0, equals));
  if (equals == std::string::npos || !bit || *bit < 0 || *bit > highest)
    throw CLI::ValidationError(
        "--input", fmt::format("\"{}\" does not have the form BIT=WIRE with a bit from 0 to {}",
                               text, highest));
  wires_[*bit] = text.substr(equals + 1);
}

std::function<void(int, double)> wireOutputs(ModelWires* wires, const std::string& module,
                                             int count) {
  if (wires == nullptr) return {};
  std::vector<ModelWire> outputs;
  outputs.reserve(static_cast<std::size_t>(count));
  for (int output = 0; output < count; ++output)
    outputs.push_back(wires->wire(fmt::format("{}.{}", module, output)));
  return [outputs](int output, double volts) {
    outputs.at(static_cast<std::size_t>(output)).set(volts);
  };
}

}  // namespace mpf
