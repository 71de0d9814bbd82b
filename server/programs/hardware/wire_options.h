// SPDX-License-Identifier: MIT
// InputWires, wireOutputs(): connect models to wires: inputs follow wires (--input BIT=WIRE),
// outputs drive them.
//
//   InputWires inputs;
//   inputs.addTo(app, 31);
//   ... parse, with Hardware::addTo() before ...
//   inputs.connect(*model, hardware.wires());
//   ... make_unique<Dac128vModel>(ranges, wireOutputs(hardware.wires(), "dac", 8));
//
// Threads  the main thread of the program, at start; any thread may call the returned function.
#pragma once

#include <functional>
#include <map>
#include <string>

#include <mpf/drivers/industry_pack/model_wires.h>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf {

class InputWires {
 public:
  // Adds --input BIT=WIRE for bits 0 to `highest`, which needs --wires; `app` must not outlive
  // this.
  void addTo(CLI::App& app, int highest);

  // Connects the inputs of `model`, which has connect(int bit, callable that returns volts).
  // `wires` outlives `model`; it is not null, because --input requires --wires.
  template <class Model>
  void connect(Model& model, ModelWires* wires) const {
    for (const auto& [bit, name] : wires_)
      model.connect(bit, [wire = wires->wire(name)] { return wire.get(); });
  }

 private:
  void add(const std::string& text, int highest);
  std::map<int, std::string> wires_;  // by bit
};

// Returns a function that sets the wires "<module>.0" to "<module>.<count - 1>" to the voltages of
// a model's outputs; an empty function when `wires` is null.
[[nodiscard]] std::function<void(int output, double volts)> wireOutputs(ModelWires* wires,
                                                                        const std::string& module,
                                                                        int count);

}  // namespace mpf
