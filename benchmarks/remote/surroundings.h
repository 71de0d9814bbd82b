// SPDX-License-Identifier: MIT
// Surroundings: the network between the two sides of a remote row: the loopback of this host, or
// two network namespaces joined by a veth pair.
//
//   ┌ namespace ────────────┐                      ┌ namespace ────────────┐
//   │ server's side         │   veth       veth    │ requester's side      │
//   │ 10.0.0.1/30       mpf0├──────────────────────┤mpf0       10.0.0.2/30 │
//   └───────────────────────┘                      └───────────────────────┘
//
// The namespaces have no name: the kernel removes them, and the veth pair, with the last descriptor
// or process of the run. A run that is killed leaves nothing behind.
//
// Threads  the process that creates them must have no other thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf::bench {

class Surroundings {
 public:
  // Both sides are in the network namespace of this process.
  static Surroundings loopback();
  // Creates two namespaces, with ip(8). Throws std::runtime_error, or std::system_error without the
  // right to create them.
  static Surroundings namespaces();

  [[nodiscard]] const std::string& serverAddress() const noexcept { return serverAddress_; }
  // Moves the calling process, which must have one thread only, into the namespace of a side.
  void enterServer() const { enter(server_); }
  void enterRequester() const { enter(requester_); }

 private:
  static void enter(const std::shared_ptr<FileDescriptor>& net);

  std::string serverAddress_;
  // The namespaces; nullptr: that of this process.
  std::shared_ptr<FileDescriptor> server_, requester_;
};

}  // namespace mpf::bench
