// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/request_queue.h"

#include <algorithm>
#include <utility>

namespace mpf {

void GpibRequestQueue::push(GpibWork&& work) {
  {
    const std::lock_guard lock(mutex_);
    nextExpiry_ = std::min(nextExpiry_, work.request.until);
    auto client = std::ranges::find(clients_, work.client, &Client::id);
    if (client == clients_.end()) client = clients_.insert(clients_.end(), Client{work.client, {}});
    client->requests.push_back(std::move(work));
  }
  wake();
}

std::optional<GpibWork> GpibRequestQueue::tryTake(GpibUser holder) {
  const std::lock_guard lock(mutex_);
  const auto client =
      holder == 0 ? clients_.begin() : std::ranges::find(clients_, holder, &Client::id);
  if (client == clients_.end()) return std::nullopt;
  auto work = std::move(client->requests.front());
  client->requests.pop_front();
  if (client->requests.empty()) clients_.erase(client);
  else clients_.splice(clients_.end(), clients_, client);  // the others come first
  return work;
}

void GpibRequestQueue::wait(Deadline deadline) {
  std::unique_lock lock(mutex_);
  const auto isWoken = [this] { return isChanged_; };
  if (deadline.isNever()) {
    changed_.wait(lock, isWoken);
  } else {
    changed_.wait_for(lock, deadline.left(), isWoken);
  }
  isChanged_ = false;
}

void GpibRequestQueue::wake() {
  {
    const std::lock_guard lock(mutex_);
    isChanged_ = true;
  }
  changed_.notify_one();
}

Deadline GpibRequestQueue::nextExpiry() const {
  const std::lock_guard lock(mutex_);
  return nextExpiry_;
}

std::vector<GpibWork> GpibRequestQueue::takeExpired() {
  std::vector<GpibWork> expired;
  const std::lock_guard lock(mutex_);
  if (!nextExpiry_.hasPassed()) return expired;
  nextExpiry_ = Deadline::never();
  for (auto& client : clients_) {
    std::erase_if(client.requests, [&](GpibWork& work) {
      if (!work.request.until.hasPassed()) {
        nextExpiry_ = std::min(nextExpiry_, work.request.until);
        return false;
      }
      expired.push_back(std::move(work));
      return true;
    });
  }
  clients_.remove_if([](const Client& client) { return client.requests.empty(); });
  return expired;
}

void GpibRequestQueue::removeGone(const std::function<bool(const GpibWork&)>& isGone) {
  std::list<Client> gone;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  for (auto client = clients_.begin(); client != clients_.end();) {
    const auto next = std::next(client);
    if (isGone(client->requests.front())) gone.splice(gone.end(), clients_, client);
    client = next;
  }
}

}  // namespace mpf
