// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_link.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <system_error>

#include <mpf/drivers/serial/posix_terminal.h>
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
    static_cast<GpibResult&>(result) = controller_.write(kEcho, raw(question), true, deadline);
    return result.ok() ? controller_.read(kEcho, kUntilEnd, deadline) : result;
  }
  void expectWorks() {
    const auto answer = ask("works", patient());
    EXPECT_TRUE(answer.ok()) << answer.reason;
    EXPECT_EQ(textOf(answer.data), "works");
  }
  GpibResult check(Deadline deadline) { return controller_.interfaceClear(deadline); }

  PrologixStand stand_{GetParam()};
  PrologixController controller_{stand_.address(), Watchdog::kPatience};
};

INSTANTIATE_TEST_SUITE_P(Lines, PrologixLinkTest, kBothLines, nameOfLine);

TEST_P(PrologixLinkTest, AControllerThatDoesNotAnswerIsAnError) {
  stand_.model.behave({.isSilent = true});

  withLaterDeadlines([&](Deadline deadline) {
    const auto result = check(deadline);
    EXPECT_FALSE(result.ok());
    EXPECT_THAT(result.reason, HasSubstr(stand_.address()));
    return result.reason.find("does not answer to ++ver") != std::string::npos;
  });

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

  const auto result = controller_.write(kEcho, raw("no"), true, Deadline::after(0ms));

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
    // Of a message that was cut, the instrument keeps the part that arrived.
    EXPECT_TRUE(controller_.clear(kEcho, patient()).ok());
    expectWorks();
  }
}

TEST(PrologixLink, OpensANewConnectionWhenTheControllerStaysSilent) {
  const TerminalServer server;
  PrologixController controller(server.address().toString(), 1ms);
  const auto silent = server.accept();

  EXPECT_FALSE(controller.interfaceClear(patient()).ok());
  EXPECT_FALSE(controller.interfaceClear(patient()).ok());

  EXPECT_TRUE(server.accept());
}

TEST(PrologixLink, SaysWhyThereIsNoConnection) {
  TerminalServer server;
  server.switchOff();
  PrologixController controller(server.address().toString());

  const auto result = controller.interfaceClear(soon());

  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, HasSubstr("no connection"));
}

TEST(PrologixLink, AnExchangeReturnsWhatTheCommandsAnswered) {
  PrologixStand stand(PrologixStand::Line::tcp);
  const auto openPort = [&] {
    return openTcpSerialPort(
        {.address = TcpAddress::parse(stand.address()), .waitForServer = true});
  };
  PrologixLink link("Prologix", openPort, Watchdog::kPatience);
  stand.plugIn();

  const auto answer =
      link.exchange({.commands = "++addr 9 101\n++addr\n++eos\n", .deadline = patient()});
  const auto next = link.exchange({.commands = "++eot_char\n", .deadline = patient()});

  EXPECT_TRUE(answer.result.ok()) << answer.result.reason;
  EXPECT_EQ(textOf(answer.bytes), "9 101\r\n3\r\n");
  EXPECT_EQ(textOf(next.bytes), std::to_string(next.mark) + "\r\n");
  EXPECT_NE(next.mark, answer.mark);
  const auto another = static_cast<std::uint8_t>(128 | (next.mark + 1));
  const auto skipped =
      link.exchange({.commands = "", .deadline = patient(), .otherMarkThan = another});
  EXPECT_NE(skipped.mark, another);
}

// Only a silence distinguishes a last byte without END from the mark that follows END.
TEST(PrologixLink, TellsWhetherThereWasSilenceBeforeTheEnd) {
  PrologixStand stand(PrologixStand::Line::terminal);
  stand.plugIn();
  const auto openPort = [&] {
    return openPosixTerminal({.device = stand.address(), .waitForDevice = true});
  };
  PrologixLink link("Prologix", openPort, Watchdog::kPatience);
  // A busy host may add a silence or hide one, so it may take longer ones to see the difference.
  const auto hasSilence = [&](bool sendsEnd, Deadline wait) {
    const auto silence = std::chrono::ceil<std::chrono::milliseconds>(wait.left());
    stand.echo->sendsEnd = sendsEnd;
    stand.echo->say("a");
    const auto answer = link.exchange(
        {.commands = fmt::format("++addr 22\n++read_tmo_ms {}\n++read eoi\n", silence.count()),
         .deadline = patient(),
         .silence = silence});
    EXPECT_TRUE(answer.result.ok()) << answer.result.reason;
    return answer.endsWithSilence;
  };

  withLaterDeadlines([&](Deadline wait) { return hasSilence(false, wait); });
  withLaterDeadlines([&](Deadline wait) { return !hasSilence(true, wait); });
}

// As when the process has no thread or descriptor left.
TEST(PrologixLink, APortThatCannotBeOpenedAgainIsAnErrorUntilItCan) {
  int opened = 0;
  const auto openPort = [&]() -> std::unique_ptr<SerialPort> {
    if (++opened == 2) throw std::system_error(EMFILE, std::generic_category(), "open");
    return openTcpSerialPort(
        {.address = TcpAddress::parse("127.0.0.1:1"), .waitForServer = true});  // nobody listens
  };
  PrologixLink link("the controller", openPort, 1ms);
  const auto ask = [&] {
    return link.exchange({.commands = {}, .deadline = Deadline::after(2ms)}).result;
  };

  GpibResult result;
  while (opened < 2) result = ask();
  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, testing::AllOf(HasSubstr("the controller"), HasSubstr("open")));
  while (opened < 3) EXPECT_FALSE(ask().ok());
}

}  // namespace
}  // namespace mpf::test
