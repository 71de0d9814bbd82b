// SPDX-License-Identifier: MIT
#include "server/programs/hardware/wire_options.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A model that keeps what it is connected to: each input is a callable that returns volts.
struct InputModel {
  void connect(int bit, std::function<double()> volts) { inputs[bit] = std::move(volts); }
  [[nodiscard]] std::vector<int> bits() const {
    std::vector<int> all;
    for (const auto& [bit, volts] : inputs) all.push_back(bit);
    return all;
  }
  std::map<int, std::function<double()>> inputs;
};

class WireOptionsTest : public testing::Test {
 protected:
  static void parse(InputWires& inputs, const std::string& line) {
    CLI::App app;
    std::string path;
    app.add_option("--wires", path);
    inputs.addTo(app, 7);
    app.parse(line);
  }
  static std::string refusalOf(const std::string& line) {
    InputWires inputs;
    try {
      parse(inputs, line);
    } catch (const CLI::ParseError& error) {
      return error.what();
    }
    return {};
  }

  TemporaryFolder folder_;
  ModelWires wires_{folder_.file("wires")};
};

TEST_F(WireOptionsTest, AnInputFollowsItsWire) {
  InputWires inputs;
  InputModel model;
  parse(inputs, "--wires file --input 0=dac.1 --input 7=dio.20");

  inputs.connect(model, &wires_);

  ASSERT_THAT(model.bits(), ElementsAre(0, 7));
  wires_.wire("dac.1").set(2.5);
  wires_.wire("dio.20").set(5);
  EXPECT_EQ(model.inputs[0](), 2.5);
  EXPECT_EQ(model.inputs[7](), 5);
}

TEST_F(WireOptionsTest, TheLastWireOfAnInputCounts) {
  InputWires inputs;
  InputModel model;
  parse(inputs, "--wires file --input 3=first --input 3=second");

  inputs.connect(model, &wires_);

  wires_.wire("second").set(4);
  EXPECT_EQ(model.inputs[3](), 4);
}

TEST_F(WireOptionsTest, WithoutOptionsNoInputIsConnected) {
  const InputWires inputs;
  InputModel model;

  inputs.connect(model, nullptr);

  EXPECT_THAT(model.bits(), ElementsAre());
}

TEST_F(WireOptionsTest, AnInputNeedsABitInTheRangeAndAWire) {
  for (const auto* const text : {"8=dac.0", "-1=dac.0", "x=dac.0", "=dac.0", "3x=dac.0", "3"}) {
    EXPECT_THAT(refusalOf(std::string("--wires file --input=") + text),
                HasSubstr(std::string("\"") + text +
                          "\" does not have the form BIT=WIRE with a bit from 0 to 7"));
  }
  EXPECT_THAT(refusalOf("--input 3=dac.0"), HasSubstr("--input requires --wires"));
}

TEST_F(WireOptionsTest, OutputsDriveTheWiresOfTheirModule) {
  const auto set = wireOutputs(&wires_, "dac", 2);

  set(0, 1.5);
  set(1, -3);

  EXPECT_EQ(wires_.wire("dac.0").get(), 1.5);
  EXPECT_EQ(wires_.wire("dac.1").get(), -3);
  EXPECT_THROW(set(2, 1), std::out_of_range);
}

TEST_F(WireOptionsTest, OutputsWithoutWiresAreAnEmptyFunction) {
  EXPECT_FALSE(wireOutputs(nullptr, "dac", 8));
}

}  // namespace
}  // namespace mpf::test
