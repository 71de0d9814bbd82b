// SPDX-License-Identifier: MIT
#include "server/connection.h"

#include <mutex>
#include <utility>

namespace mpf {
namespace {

std::mutex freeMutex;
Connection* freeConnections = nullptr;  // under freeMutex

}  // namespace

Connection::Pointer Connection::take() {
  {
    const std::lock_guard guard(freeMutex);
    if (freeConnections != nullptr)
      return Pointer(std::exchange(freeConnections, freeConnections->nextFree));
  }
  return Pointer(new Connection);
}

void Connection::GiveBack::operator()(Connection* connection) const noexcept {
  // Still open: this process is a forked child, and the server and its handles are copies.
  if (connection->channel) return delete connection;
  const std::lock_guard guard(freeMutex);
  connection->nextFree = std::exchange(freeConnections, connection);
}

}  // namespace mpf
