// SPDX-License-Identifier: MIT
// Message and its types in the form of the original MPF: objects on the heap, owned by pointer.
//
//   Message ─┬─ ConnectMessage             status
//            ├─ SerialConfigMessage        baud, stopBits, ...
//            └─ StandardFieldsMessage      timeout, cmd, status, address, extra
//                 ├─ Int32Message, Float64Message, OutOfBandMessage      value
//                 └─ Int32ArrayMessage, Float64ArrayMessage, Char8ArrayMessage
//                                          value, a pointer to the elements
//
//   Int32Message* message = new Int32Message;
//   message->value = 5;
//   client->send(message);              // owns the message from now on, also when it fails
//
// The classes are in the global namespace, because old sources declare them there. All fields are 0
// in a new message. <mpf/message.h> has the messages of new programs; both forms are the same
// message for the other end.
//
// Threads  one thread at a time uses a message.
// Crash    a request that is deleted without a reply is refused: its client gets an answer.
// Trust    the elements of a received array may be in memory that the sender can change; fields are
//          copies.
// Throws   nothing; `new` throws std::bad_alloc.
// Source   manual, "Message", "StandardFieldsMessage" and the section of each type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <mpf/message_of.h>

// NOLINTBEGIN(readability-identifier-naming): names of the manual

typedef std::int16_t int16;
typedef std::uint16_t uint16;
typedef std::int32_t int32;
typedef std::uint32_t uint32;
typedef float float32;
typedef double float64;

// The numbers are those of mpf::MessageType.
enum messageType : int {
  messageTypeConnect = 1,
  messageTypeInt32,
  messageTypeInt32Array,
  messageTypeFloat64,
  messageTypeFloat64Array,
  messageTypeChar8Array,
  messageTypeSerialConfig,
  messageTypeOutOfBand
};

// The status of a ConnectMessage: see mpf::ConnectStatus.
enum connectStatus { connectNo, connectYes, connectQueueFull, connectRefused };

// The status of a request that comes back without having been answered: see MessageClient.
enum fateStatus {
  fateRefused = -1,  // the server deleted it without a reply, or did not accept it
  fateNeverTaken = -2,  // the server went away before it took the request: nothing was done
  fateOutcomeUnknown = -3,  // the server went away after it took the request
  fateExpired = -4,
  fateCancelled = -5
};

namespace mpf::classic {
class Transfer;  // moves messages between this form and that of <mpf/message.h>
}

class Message {
 public:
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  virtual ~Message() = default;

  messageType getType() const { return type_; }
  // Two numbers of the client: each reply has those of its request.
  int32 getClientType() const { return clientType_; }
  void setClientType(int32 type) { clientType_ = type; }
  int32 getClientExtra() const { return clientExtra_; }
  void setClientExtra(int32 extra) { clientExtra_ = extra; }
  // Prints the message as one line to stdout.
  virtual void print() const;
  // A new message, to be deleted; null for a number that is not in messageType.
  static Message* allocate(messageType type);

 protected:
  explicit Message(messageType type) : type_(type) {}

 private:
  friend class mpf::classic::Transfer;
  // `message` has this type and a valid body.
  virtual void load(mpf::Message&& message) = 0;
  // Moves the elements of an array; they are gone then. Throws std::bad_alloc.
  [[nodiscard]] virtual mpf::Message unload() = 0;
  // Sets the status, if the type has one.
  virtual void setFate(fateStatus) {}

  messageType type_;
  int32 clientType_ = 0;
  int32 clientExtra_ = 0;
  // Of requests and of replies made for them: an empty handle with the route of the request, which
  // is refused when all of them are deleted without a reply.
  std::shared_ptr<mpf::Message> request_;
};

class ConnectMessage : public Message {
 public:
  ConnectMessage() : Message(messageTypeConnect) {}
  int32 status = connectNo;

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
};

class SerialConfigMessage : public Message {
 public:
  SerialConfigMessage() : Message(messageTypeSerialConfig) {}
  int32 baud = 0, stopBits = 0, bitsPerChar = 0;
  char parity = 0, flowControl = 0;

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
};

class StandardFieldsMessage : public Message {
 public:
  int32 timeout = 0, cmd = 0, status = 0, address = 0, extra = 0;

 protected:
  using Message::Message;

 private:
  void setFate(fateStatus fate) override { status = fate; }
};

class Int32Message : public StandardFieldsMessage {
 public:
  Int32Message() : StandardFieldsMessage(messageTypeInt32) {}
  int32 value = 0;

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
};

class Float64Message : public StandardFieldsMessage {
 public:
  Float64Message() : StandardFieldsMessage(messageTypeFloat64) {}
  float64 value = 0;

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
};

class OutOfBandMessage : public StandardFieldsMessage {
 public:
  OutOfBandMessage() : StandardFieldsMessage(messageTypeOutOfBand) {}
  int32 value = 0;

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
};

namespace mpf::classic {

// The elements of an array message, and their memory, which the message owns.
template <class Body>
class ArrayMessage : public ::StandardFieldsMessage {
 public:
  using Element = typename Body::Element;
  // The elements; null without any. Set by allocValue() only.
  Element* value = nullptr;

  // Allocates memory for n elements, all 0, in place of the former elements. The length is 0 until
  // it is set.
  //   returns  value; null when there is no memory
  Element* allocValue(int n);
  // Frees the elements, as `delete` does.
  void freeValue();

 protected:
  using StandardFieldsMessage::StandardFieldsMessage;
  [[nodiscard]] int count() const;
  [[nodiscard]] int maxCount() const;
  // Limits n to 0 to maxCount().
  void setCount(int n);

 private:
  void load(mpf::Message&& message) override;
  mpf::Message unload() override;
  // The fields other than the standard ones.
  virtual void loadOthers(const Body&) {}
  virtual void unloadOthers(Body&) const {}

  std::optional<mpf::MessageOf<Body>> body_;
};

}  // namespace mpf::classic

class Int32ArrayMessage : public mpf::classic::ArrayMessage<mpf::Int32Array> {
 public:
  Int32ArrayMessage() : ArrayMessage(messageTypeInt32Array) {}
  void setLength(int length) { setCount(length); }
  int getLength() const { return count(); }
  int getMaxLength() const { return maxCount(); }
};

class Float64ArrayMessage : public mpf::classic::ArrayMessage<mpf::Float64Array> {
 public:
  Float64ArrayMessage() : ArrayMessage(messageTypeFloat64Array) {}
  void setLength(int length) { setCount(length); }
  int getLength() const { return count(); }
  int getMaxLength() const { return maxCount(); }
};

class Char8ArrayMessage : public mpf::classic::ArrayMessage<mpf::Char8Array> {
 public:
  Char8ArrayMessage() : ArrayMessage(messageTypeChar8Array) {}
  void setSize(int size) { setCount(size); }
  int getSize() const { return count(); }
  int getMaxSize() const { return maxCount(); }

  int32 numberRetrys = 0;
  int32 eomLen = 0;
  char eomString[4] = {};

 private:
  void loadOthers(const mpf::Char8Array& body) override;
  void unloadOthers(mpf::Char8Array& body) const override;
};

// NOLINTEND(readability-identifier-naming)
