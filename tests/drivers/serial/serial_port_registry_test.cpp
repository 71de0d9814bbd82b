// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_port_registry.h>

#include <gmock/gmock.h>
#include <stdexcept>

#include <mpf/drivers/serial/posix_terminal.h>

#include "tests/drivers/serial/line_collector.h"
#include "tests/support/instrument.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class SerialPortRegistryTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  Instrument instrument_{folder_.file("tty")};
  const std::shared_ptr<SerialPort> port_ = openPosixTerminal({.device = folder_.file("tty")});
  SerialPortRegistry registry_;
};

TEST_F(SerialPortRegistryTest, FindsByName) {
  registry_.registerName("UART[1]", port_);
  registry_.registerName("UART[0]", port_);

  EXPECT_EQ(registry_.find("UART[0]"), port_);
  EXPECT_EQ(registry_.find("UART[2]"), nullptr);
  EXPECT_THAT(registry_.names(), ElementsAre("UART[0]", "UART[1]"));
}

TEST_F(SerialPortRegistryTest, RefusesANameThatIsEmptyOrInUse) {
  registry_.registerName("UART[0]", port_);

  EXPECT_THAT([&] { registry_.registerName("UART[0]", port_); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("\"UART[0]\": the name is in use")));
  EXPECT_THAT([&] { registry_.registerName("", port_); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the name is empty")));
}

TEST_F(SerialPortRegistryTest, BindsByName) {
  LineCollector collector;
  registry_.registerName("UART[0]", port_);

  const auto line = registry_.bind("UART[0]", collector);

  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
  EXPECT_THROW(static_cast<void>(registry_.bind("UART[0]", collector)), std::runtime_error);
  EXPECT_THAT([&] { static_cast<void>(registry_.bind("UART[1]", collector)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("UART[1]")));
}

}  // namespace
}  // namespace mpf::test
