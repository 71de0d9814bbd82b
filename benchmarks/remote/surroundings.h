// SPDX-License-Identifier: MIT
// Surroundings: what lies between the two sides of a remote row: this host's loopback, or two
// network namespaces joined by a veth pair.
//
//   ┌ namespace ────────────┐                      ┌ namespace ────────────┐
//   │ server's side         │   veth       veth    │ requester's side      │
//   │ 10.0.0.1/30       mpf0├──────────────────────┤mpf0       10.0.0.2/30 │
//   └───────────────────────┘                      └───────────────────────┘
//
// The namespaces have no name: they live as long as a descriptor or a process of the run does, and
// go with the last one, veth pair included. A run that is killed leaves nothing behind.
//
// Threads  made by a process that has no other thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf::bench {

class Surroundings {
 public:
  // Both sides in the network namespace that this process is in.
  static Surroundings loopback();
  // Makes two namespaces, with ip(8). Throws std::runtime_error with the reason when that is not
  // possible here.
  static Surroundings namespaces();

  [[nodiscard]] const std::string& serverAddress() const noexcept { return serverAddress_; }
  // Puts the calling process, which must have one thread only, into a side's namespace.
  void enterServer() const { enter(server_); }
  void enterRequester() const { enter(requester_); }

 private:
  static void enter(const std::shared_ptr<FileDescriptor>& net);

  std::string serverAddress_;
  std::shared_ptr<FileDescriptor> server_,
      requester_;  // of the namespaces; nullptr: the one that everybody is in
};

}  // namespace mpf::bench
