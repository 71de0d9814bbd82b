// SPDX-License-Identifier: MIT
// Handlers: which handler is found, and how long one that is replaced exists.
#include "server/handlers.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

constexpr auto kNumber = static_cast<std::uint16_t>(MessageType::int32);

TEST(Handlers, AreFoundByTheNumberOfTheirType) {
  Handlers handlers;
  handlers.set(MessageType::int32, [](Message&&) {});
  handlers.set(MessageType::float64, [](Message&&) {}, [](std::span<std::byte>) {});

  EXPECT_NE(handlers.find(kNumber), nullptr);
  EXPECT_EQ(handlers.findForRun(kNumber), nullptr);
  EXPECT_NE(handlers.findForRun(static_cast<std::uint16_t>(MessageType::float64)), nullptr);
  EXPECT_EQ(handlers.find(static_cast<std::uint16_t>(MessageType::outOfBand)), nullptr);
  EXPECT_EQ(handlers.find(60000), nullptr);
  EXPECT_EQ(handlers.findForRun(60000), nullptr);
}

TEST(Handlers, ThatAreReplacedExistUntilTheOutermostCallReturns) {
  Handlers handlers;
  const auto owned = std::make_shared<int>();
  handlers.set(MessageType::int32, [owned](Message&&) {});
  {
    const Handlers::Call outer(handlers);
    {
      const Handlers::Call inner(handlers);
      handlers.set(MessageType::int32, [](Message&&) {});
    }
    EXPECT_EQ(owned.use_count(), 2);
  }
  EXPECT_EQ(owned.use_count(), 1);

  handlers.set(MessageType::int32, [owned](Message&&) {});
  handlers.set(MessageType::int32, [](Message&&) {});

  EXPECT_EQ(owned.use_count(), 1) << "no handler runs, but the replaced one was kept";
}

}  // namespace
}  // namespace mpf::test
