// SPDX-License-Identifier: MIT
#include "drivers/serial/name_lookup.h"

#include <netdb.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cstring>
#include <fmt/format.h>
#include <mutex>
#include <thread>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf {
namespace {

NameLookup::Result lookUp(const TcpAddress& address) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int code = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &list);
  if (code != 0)
    return {{}, fmt::format("resolve {}: {}", address.toString(), ::gai_strerror(code))};
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(list, &::freeaddrinfo);
  NameLookup::Result result;
  for (const auto* entry = list; entry != nullptr; entry = entry->ai_next) {
    auto& to = result.addresses.emplace_back();
    std::memcpy(&to.storage, entry->ai_addr, entry->ai_addrlen);
    to.length = entry->ai_addrlen;
  }
  return result;
}

}  // namespace

struct NameLookup::Answer {
  FileDescriptor ready{checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")};
  std::mutex mutex;
  std::optional<Result> result;  // under mutex
};

NameLookup::NameLookup(const TcpAddress& address) : answer_(std::make_shared<Answer>()) {
  std::thread([answer = answer_, address] {
    auto result = lookUp(address);
    {
      const std::lock_guard lock(answer->mutex);
      answer->result = std::move(result);
    }
    const std::uint64_t one = 1;
    // the first write to an eventfd cannot fail
    static_cast<void>(
        retryInterrupted([&] { return ::write(answer->ready.get(), &one, sizeof one); }));
  }).detach();
}

int NameLookup::descriptor() const noexcept { return answer_->ready.get(); }

std::optional<NameLookup::Result> NameLookup::tryTake() {
  const std::lock_guard lock(answer_->mutex);
  return std::exchange(answer_->result, std::nullopt);
}

}  // namespace mpf
