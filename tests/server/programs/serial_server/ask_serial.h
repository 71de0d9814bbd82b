// SPDX-License-Identifier: MIT
// askSerial(): sends one request to a serial server and returns its result.
#pragma once

#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <string>
#include <string_view>
#include <utility>

#include <mpf/sync_client.h>

namespace mpf::test {

struct SerialReply {
  std::int32_t status;
  std::string text;
  friend bool operator==(const SerialReply&, const SerialReply&) = default;
};

inline SerialReply askSerial(SyncClient& client, std::string_view text, const Char8Array& fields) {
  auto message = Char8ArrayMessage::allocValue(text.size());
  *message = fields;
  message.setSize(text.size());
  std::copy(text.begin(), text.end(), message.value().begin());
  auto answer = client.call(std::move(message), std::chrono::minutes(1));
  EXPECT_TRUE(answer) << answer.why();
  auto reply = answer.as<Char8Array>();
  if (!reply) return {-1, "not a Char8Array"};
  return {(*reply)->status, std::string(reply->value().begin(), reply->value().end())};
}

}  // namespace mpf::test
