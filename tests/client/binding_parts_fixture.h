// SPDX-License-Identifier: MIT
// BindingPartsTest: the parts of a Binding, a RequestSender and a Connector, without the Binding.
#pragma once

#include <atomic>
#include <gtest/gtest.h>
#include <memory>
#include <string>

#include "client/binding.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {

class BindingPartsTest : public testing::Test {
 protected:
  TestBackplane backplane_;
  DispatcherParts parts_{backplane_,      layout::SegmentKind::clientWindow,
                         std::string(),   Rights{.mode = 0600},
                         WaitMode::block, [](layout::SegmentHeader&) {}};
  std::shared_ptr<Binding> owner_ = std::make_shared<Binding>(parts_, [](Message&&) {});
  std::atomic<BindingState> state_{BindingState::waiting};
  BindingTimer timer_{parts_.timer};
  int reports_ = 0;  // of refused requests
  RequestSender sender_{state_, parts_.endpoint.control(), timer_, [this] { ++reports_; }};
  Connector connector_{parts_, timer_};
};

}  // namespace mpf::test
