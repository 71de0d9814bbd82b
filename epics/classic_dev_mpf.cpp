// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <errlog.h>
#include <initHooks.h>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <mpf/epics/classic.h>

#include "classic/messages/transfer.h"
#include "epics/record_queue.h"
#include "epics/shared_client.h"

using mpf::classic::Transfer;

namespace {

// The objects that were constructed since the IOC was built.
class Unbound {
 public:
  void add(DevMpf& device) {
    initHookRegister(onInitHook);  // Base forgets hooks when an IOC ends
    const std::lock_guard lock(mutex_);
    devices_.push_back(&device);
  }
  void bindAll() {
    std::vector<DevMpf*> devices;
    {
      const std::lock_guard lock(mutex_);
      devices.swap(devices_);
    }
    for (auto* device : devices) device->bind();
  }
  static Unbound& instance() {
    static auto* const unbound = new Unbound;
    return *unbound;
  }

 private:
  static void onInitHook(initHookState state) {
    if (state == initHookAfterInitDatabase) instance().bindAll();
  }
  std::mutex mutex_;
  std::vector<DevMpf*> devices_;  // under mutex_
};

void logUnexpected(const dbCommon* record, messageType type) {
  errlogPrintf("%s: unexpected %s message\n", record->name,
               std::string(mpf::toString(static_cast<mpf::MessageType>(type))).c_str());
}

}  // namespace

DevMpf::DevMpf(dbCommon* record, DBLINK* link, bool ioInterrupt)
    : mpf::DevMpf(record, link, ioInterrupt), ioscanpvt(ioScan()), iointValid(ioInterrupt) {
  Unbound::instance().add(*this);
}

void DevMpf::bind() {
  if (!std::exchange(isBound_, true)) mpf::DevMpf::bind();
}

int DevMpf::send(Message* message, replyType reply) try {
  const std::unique_ptr<Message> owned(message);
  const auto type = owned->getType();
  const auto extra = owned->getClientExtra();
  if (mpf::DevMpf::send(Transfer::send(*owned), reply) != 0) return -1;
  if (reply == replyTypeReceiveReply) sentTypes_.emplace(extra, type);
  return 0;
} catch (const std::exception& error) {
  errlogPrintf("a message cannot be sent to server \"%s\": %s\n", getServer().c_str(),
               error.what());
  return -1;
}

bool DevMpf::connectWait(double timeout) {
  const std::chrono::duration<double> seconds(std::max(timeout, 0.0));
  return mpf::DevMpf::connectWait(std::chrono::duration_cast<std::chrono::nanoseconds>(seconds));
}

long DevMpf::completeIO(dbCommon* record, mpf::Message&& message) {
  auto received = Transfer::receive(std::move(message));
  if (!received) return fail(record, "a reply of an unknown type");
  return completeIO(record, received.release());
}

messageType DevMpf::takeSentType(const mpf::Message& message) {
  const auto sent = sentTypes_.find(message.getClientExtra());
  if (sent == sentTypes_.end()) return messageTypeInt32;
  const auto type = sent->second;
  if (mpf::endsRequest(message)) sentTypes_.erase(sent);
  return type;
}

void DevMpf::receiveReply(dbCommon* record, mpf::Message&& message) {
  const auto sentType = takeSentType(message);
  auto received = Transfer::receive(std::move(message));
  if (!received) {
    // NOLINTNEXTLINE(bugprone-use-after-move): receive() has left it unchanged
    const auto* fate = message.tryAs<mpf::RequestFate>();
    std::unique_ptr<Message> request(Message::allocate(sentType));
    request->setClientExtra(message.getClientExtra());
    received = Transfer::withFate(std::move(request),
                                  fate != nullptr ? fate->fate : mpf::Fate::outcomeUnknown);
  }
  receiveReply(record, received.release());
}

void DevMpf::connectIO(dbCommon* record, const mpf::Connect& connect) {
  auto message = std::make_unique<ConnectMessage>();
  message->status = static_cast<int32>(connect.status);
  connectIO(record, message.release());
}

void DevMpf::outOfBandIO(dbCommon* record, mpf::Message&& message) {
  if (mpf::SharedClient::replyTypeOf(message) == replyTypeReceiveReply)
    static_cast<void>(takeSentType(message));  // in place of the reply it ends the request
  auto received = Transfer::receive(std::move(message));
  if (received) outOfBandIO(record, static_cast<OutOfBandMessage*>(received.release()));
}

void DevMpf::receiveReply(dbCommon* record, Message* message) {
  const std::unique_ptr<Message> owned(message);
  logUnexpected(record, message->getType());
}

void DevMpf::connectIO(dbCommon* record, Message* message) {
  const std::unique_ptr<Message> owned(message);
  mpf::Connect connect;
  connect.status =
      static_cast<mpf::ConnectStatus>(static_cast<const ConnectMessage*>(message)->status);
  mpf::DevMpf::connectIO(record, connect);
}

void DevMpf::outOfBandIO(dbCommon* record, OutOfBandMessage* message) {
  const std::unique_ptr<Message> owned(message);
  logUnexpected(record, message->getType());
}

long DevMpf::read_write(void* record) { return readWrite(static_cast<dbCommon*>(record)); }
long DevMpf::ioint(int cmd, dbCommon* record, IOSCANPVT* iopvt) {
  return getIoIntInfo(cmd, record, iopvt);
}
long DevMpf::linconv(void* record, int pass) {
  return linearConvert(static_cast<dbCommon*>(record), pass);
}
