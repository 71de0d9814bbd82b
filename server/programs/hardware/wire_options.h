// SPDX-License-Identifier: MIT
// What digital and analog models of all programs have alike on wires: outputs that drive them,
// inputs that follow them (--input BIT=WIRE).
//
//   InputWires inputs;                                  // of the command line
//   inputs.addTo(app, 31);
//   ... parse, with Hardware::addTo() before ...
//   inputs.connect(*model, hardware.wires());
//   ... make_unique<Dac128vModel>(ranges, wireOutputs(hardware.wires(), "dac", 8));
//
// Threads  the program's main thread, at start; what is returned from any.
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

  // Model has connect(int bit, callable that returns volts). `wires` is not null if the command
  // line was right, and outlives `model`.
  template <class Model>
  void connect(Model& model, ModelWires* wires) const {
    for (const auto& [bit, name] : wires_)
      model.connect(bit, [wire = wires->wire(name)] { return wire.get(); });
  }

 private:
  void add(const std::string& text, int highest);
  std::map<int, std::string> wires_;  // by bit
};

// Told what outputs 0 to `count` - 1 of a model give, in volts, it sets the wires "<module>.0",
// ...; empty when `wires` is null.
[[nodiscard]] std::function<void(int output, double volts)> wireOutputs(ModelWires* wires,
                                                                        const std::string& module,
                                                                        int count);

}  // namespace mpf
