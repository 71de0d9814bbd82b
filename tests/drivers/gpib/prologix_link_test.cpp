// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include <mpf/drivers/gpib/prologix.h>
#include <mpf/drivers/serial/tcp_serial_port.h>

#include "drivers/gpib/prologix_controller.h"
#include "tests/drivers/gpib/gpib_test_values.h"
#include "tests/drivers/gpib/prologix_stand.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using std::chrono_literals::operator""ms;
using testing::HasSubstr;

class PrologixLinkTest : public testing::TestWithParam<PrologixStand::Line> {
 protected:
  PrologixLinkTest() { stand_.plugIn(); }

  GpibReadResult ask(std::string_view question, Deadline deadline) {
    GpibReadResult result;
    static_cast<GpibResult&>(result) = controller_->write(kEcho, raw(question), true, deadline);
    return result.ok() ? controller_->read(kEcho, kUntilEnd, deadline) : result;
  }
  void expectWorks() {
    const auto answer = ask("works", patient());
    EXPECT_TRUE(answer.ok()) << answer.reason;
    EXPECT_EQ(textOf(answer.data), "works");
  }
  GpibResult check(Deadline deadline) { return controller_->interfaceClear(deadline); }

  PrologixStand stand_{GetParam()};
  std::unique_ptr<GpibController> controller_ = openPrologix({.address = stand_.address()});
};

INSTANTIATE_TEST_SUITE_P(Lines, PrologixLinkTest, kBothLines, nameOfLine);

TEST_P(PrologixLinkTest, AControllerThatDoesNotAnswerIsAnError) {
  stand_.model.behave({.isSilent = true});

  const auto result = check(soon());

  EXPECT_EQ(result.status, GpibStatus::timeout);
  EXPECT_THAT(result.reason, HasSubstr(stand_.address()));
  EXPECT_THAT(result.reason, HasSubstr("does not answer to ++ver"));
  stand_.model.behave({});
  expectWorks();
}

TEST_P(PrologixLinkTest, AForeignVersionIsAnError) {
  stand_.model.behave({.version = "ACME Toaster 9"});

  const auto result = check(patient());

  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, HasSubstr("ACME Toaster 9"));
  stand_.model.behave({});
  expectWorks();
}

TEST_P(PrologixLinkTest, ADamagedVersionIsAnError) {
  stand_.model.behave({.garbage = "Prologix GPIB\r\n"});

  EXPECT_FALSE(check(patient()).ok());

  stand_.model.behave({});
  expectWorks();
}

TEST_P(PrologixLinkTest, AcceptsTheVersionOfTheUsbController) {
  stand_.model.behave({.version = "Prologix GPIB-USB Controller version 6.107"});

  expectWorks();
}

TEST_P(PrologixLinkTest, ALostConnectionCostsOneOperation) {
  expectWorks();
  stand_.model.behave({.cutsConnection = true});

  const auto lost = check(soon());

  EXPECT_FALSE(lost.ok());
  stand_.unplug();
  stand_.model.behave({});
  stand_.plugIn();
  expectWorks();
}

// The port may not have noticed the loss yet when the next operation begins.
TEST_P(PrologixLinkTest, ALossBetweenOperationsCostsOneAtMost) {
  expectWorks();

  stand_.unplug();
  stand_.plugIn();
  static_cast<void>(check(soon()));

  expectWorks();
}

TEST_P(PrologixLinkTest, ALateAnswerIsNotTheAnswerToTheNextQuestion) {
  expectWorks();
  for (int i = 0; i < 5; ++i) {
    stand_.model.behave({.delay = 60ms});
    const auto late = ask("late", Deadline::after(std::chrono::milliseconds(100 + 90 * i)));
    EXPECT_EQ(late.status, GpibStatus::timeout);

    stand_.model.behave({});
    expectWorks();
  }
}

TEST_P(PrologixLinkTest, GarbageEndsInAStatusAndTheNextOperationWorks) {
  expectWorks();
  stand_.model.behave({.garbage = "\xff\r\n+\x1b"});

  EXPECT_FALSE(check(soon()).ok());

  stand_.model.behave({});
  expectWorks();
}

TEST_P(PrologixLinkTest, AnOperationWhoseDeadlineHasPassedSendsNothing) {
  expectWorks();
  stand_.echo->takeReceived();

  const auto result = controller_->write(kEcho, raw("no"), true, Deadline::after(0ms));

  EXPECT_EQ(result.status, GpibStatus::timeout);
  expectWorks();
  EXPECT_EQ(stand_.echo->takeReceived(), "works");
}

TEST_P(PrologixLinkTest, AfterAnyFaultTheNextOperationWorks) {
  Random random;
  const auto sent = manyBytes(3000);
  for (int i = 0; i < 40; ++i) {
    const auto kind = random.below(8);  // 4 to 7: nothing but a short deadline
    stand_.model.behave({.delay = kind == 0 ? 15ms : 0ms,
                         .garbage = kind == 1 ? "Prologix GPIB\r\n" : "",
                         .isSilent = kind == 2,
                         .cutsConnection = kind == 3});
    static_cast<void>(ask(sent, Deadline::after(std::chrono::milliseconds(random.below(60)))));
    if (kind == 3) stand_.unplug();
    stand_.model.behave({});
    if (kind == 3) {
      stand_.plugIn();
      static_cast<void>(check(soon()));  // may not have noticed the loss yet
    }
    expectWorks();
  }
}

// A controller whose instrument never stops is stuck in ++read; the way out is a new connection.
TEST(PrologixLink, OpensANewConnectionWhenTheControllerStaysBusy) {
  PrologixStand stand(PrologixStand::Line::tcp);
  PrologixController controller(
      "Prologix",
      [&] {
        return openTcpSerialPort(
            {.address = TcpAddress::parse(stand.address()), .waitForServer = true});
      },
      300ms);
  stand.plugIn();
  stand.echo->neverEnds = true;

  const auto endless = controller.read(kEcho, kUntilEnd, soon());
  EXPECT_NE(endless.data.size(), 0U);
  stand.echo->neverEnds = false;
  stand.model.behave({.isSilent = true});
  EXPECT_FALSE(controller.interfaceClear(Deadline::after(400ms)).ok());
  EXPECT_FALSE(controller.interfaceClear(Deadline::after(100ms)).ok());
  stand.model.behave({});
  stand.plugIn();

  const auto result = controller.interfaceClear(patient());

  EXPECT_TRUE(result.ok()) << result.reason;
}

TEST(PrologixLink, SaysWhyThereIsNoConnection) {
  TerminalServer server;
  const auto controller = openPrologix({.address = server.address().toString()});
  server.switchOff();

  const auto result = controller->interfaceClear(soon());

  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, HasSubstr("no connection"));
}

TEST(PrologixLink, AnExchangeReturnsWhatTheCommandsAnswered) {
  PrologixStand stand(PrologixStand::Line::tcp);
  PrologixLink link("Prologix", [&] {
    return openTcpSerialPort(
        {.address = TcpAddress::parse(stand.address()), .waitForServer = true});
  });
  stand.plugIn();

  const auto answer =
      link.exchange({.commands = "++addr 9 101\n++addr\n++eos\n", .deadline = patient()});
  const auto next = link.exchange({.commands = "++eot_char\n", .deadline = patient()});

  EXPECT_TRUE(answer.ok()) << answer.reason;
  EXPECT_EQ(textOf(answer.bytes), "9 101\r\n3\r\n");
  EXPECT_EQ(textOf(next.bytes), std::to_string(next.mark) + "\r\n");
  EXPECT_NE(next.mark, answer.mark);
  const auto another = static_cast<std::uint8_t>(128 | (next.mark + 1));
  const auto skipped =
      link.exchange({.commands = "", .deadline = patient(), .otherMarkThan = another});
  EXPECT_NE(skipped.mark, another);
}

}  // namespace
}  // namespace mpf::test
