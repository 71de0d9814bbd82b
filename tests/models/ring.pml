// SPDX-License-Identifier: MIT
// Ring: messages of 1 or 2 slots from one producer to one consumer, with weak memory. Either may be
// killed before any step.
//
//   MODELS  shm/ring.h: RingProducer tryPush pushRun hasFree waiting isTaken
//   MODELS  shm/ring_consumer.h: RingConsumer hasMessage begin copyBody end takeRun
//   HOLDS   each message arrives once, whole and in order, while both processes run; no message
//           waits forever for slots
//   HOLDS   after the death of a producer, exactly the messages with a completed release store
//           arrive
//   HOLDS   a killed consumer has not looked at the body of any message that is not counted as taken
//           ("never taken" is true)
//   ASSUMES a ring of 4 slots, freed two at a time, and 4 messages: positions wrap around twice,
//           messages cross the end of the ring
//   ASSUMES both ends follow the protocol (tests/shm/ring_trust_test.cpp tests invalid data)
//   BREAK   SEQUENCE_RELAXED   the sequence is stored without release
//   BREAK   SEQUENCE_FIRST     the sequence is stored before the body
//   BREAK   NO_ACQUIRE         the body is loaded before the sequence
//   BREAK   FREED_EARLY        slots are freed before they are read
//   BREAK   ONE_SLOT_TOO_MANY  the producer uses one slot that is not free
//   BREAK   TAKEN_LATE         a message is counted as taken after the consumer has looked at it
//   BREAK   SECOND_UNSEEN      of two messages that are taken together, only the first is known to be
//                              complete
//   BREAK   TAKEN_IN_PART      of two messages that are taken together, only one is counted before
//                              the consumer has looked at both
#define CAPACITY 4
#define BATCH 2
#define MESSAGES 4
#ifdef ONE_SLOT_TOO_MANY
#define USABLE (CAPACITY + 1)
#else
#define USABLE CAPACITY
#endif

#define PRODUCER 0
#define CONSUMER 1
#define PROCESSES 2
#define SEQUENCE(position) ((position) % CAPACITY)
#define BODY(position) (CAPACITY + (position) % CAPACITY)
#define FREED (2 * CAPACITY)
#define TAKEN (2 * CAPACITY + 1)
#define WORDS (2 * CAPACITY + 2)
#define FLUSH_ALL \
  FLUSH(PRODUCER, 0) FLUSH(PRODUCER, 1) FLUSH(PRODUCER, 2) FLUSH(PRODUCER, 3) \
  FLUSH(PRODUCER, 4) FLUSH(PRODUCER, 5) FLUSH(PRODUCER, 6) FLUSH(PRODUCER, 7) \
  FLUSH(CONSUMER, FREED) FLUSH(CONSUMER, TAKEN)
#include "memory.pml"

byte sent;   // messages with a completed release store
byte acted;  // messages that the consumer has looked at

#define hasFree(slots) (pushed + slots - freedSeen <= USABLE)
// A body contains the number of its message and the number of its slots.
#define bodyOf(message, slots) (2 * (message) + (slots) - 1)

inline publish() {
#ifdef SEQUENCE_RELAXED
  atomic { store(PRODUCER, SEQUENCE(pushed), pushed + 1); sent++ }
#else
  atomic { storeRelease(PRODUCER, SEQUENCE(pushed), pushed + 1); sent++ }
#endif
}

inline writeBody() {
  store(PRODUCER, BODY(pushed), bodyOf(message, slots));
  if
  :: slots == 2 -> store(PRODUCER, BODY(pushed + 1), bodyOf(message, slots))
  :: else
  fi
}

active proctype Producer() {
  byte pushed, freedSeen, slots, message = 1;
  {
    do
    :: message > MESSAGES -> break
    :: message <= MESSAGES ->
      if
      :: slots = 1
      :: slots = 2
      fi;
      if
      :: hasFree(slots)
      :: else ->
        do
        :: d_step { !hasFree(slots) && memory[FREED] != freedSeen -> freedSeen = memory[FREED] }
        :: hasFree(slots) -> break
        :: isGone(CONSUMER) -> goto judge
        od
      fi;
#ifdef SEQUENCE_FIRST
      publish();
      writeBody();
#else
      writeBody();
      publish();
#endif
      d_step { pushed = pushed + slots; message++; slots = 0 }
    od;
judge:
    // The fates after the death of a consumer: a message that is not counted as taken was never
    // acted on.
    if
    :: d_step { isGone(CONSUMER) -> assert(acted <= memory[TAKEN]) }
    :: !dead[CONSUMER] && acted == MESSAGES
    fi
  } unless { dead[PRODUCER] }
}

#define hasMessage (memory[SEQUENCE(taken)] == taken + 1)

// Two messages of one slot, of which the consumer has seen only the envelopes.
#ifdef SECOND_UNSEEN
#define isFilled(position) true
#else
#define isFilled(position) (memory[SEQUENCE(position)] == position + 1)
#endif
#define hasTwo \
  (hasMessage && isFilled(taken + 1) && memory[BODY(taken)] % 2 == 0 && \
   memory[BODY(taken + 1)] % 2 == 0)

inline look() {
#ifdef NO_ACQUIRE
  d_step { body = early; acted = messages }
#else
  d_step { body = memory[BODY(taken)]; acted = messages }
#endif
  assert(body / 2 == messages);
  slots = 1 + body % 2;
  if
  :: slots == 2 -> assert(memory[BODY(taken + 1)] == body)
  :: else
  fi
}

inline handBack() {
  storeRelease(CONSUMER, FREED, taken + slots);
  freed = taken + slots
}

inline takeOne() {
  messages++;
#ifdef TAKEN_LATE
  look();
  storeRelease(CONSUMER, TAKEN, messages);
#else
  storeRelease(CONSUMER, TAKEN, messages);
#ifdef FREED_EARLY
  slots = 2;
  handBack();
#endif
  look()
#endif
}

inline takeTwo() {
  messages = messages + 2;
#ifdef TAKEN_IN_PART
  storeRelease(CONSUMER, TAKEN, messages - 1);
#else
  storeRelease(CONSUMER, TAKEN, messages);
#endif
  d_step { body = memory[BODY(taken)]; acted = messages };
  assert(body / 2 == messages - 1);
  body = memory[BODY(taken + 1)];
  assert(body / 2 == messages);
#ifdef TAKEN_IN_PART
  storeRelease(CONSUMER, TAKEN, messages);
#endif
  slots = 2
}

active proctype Consumer() {
  byte taken, freed, messages, slots, body, early;
  {
    do
    :: messages == MESSAGES -> break
    :: messages < MESSAGES ->
#ifdef NO_ACQUIRE
      early = memory[BODY(taken)];
#endif
      if
      :: hasMessage -> takeOne()
      :: hasTwo -> takeTwo()
      :: isGone(PRODUCER) && !hasMessage -> assert(messages == sent); goto ended
      fi;
#ifndef FREED_EARLY
      if
      :: taken + slots - freed >= BATCH || memory[SEQUENCE(taken + slots)] != taken + slots + 1 -> handBack()
      :: else
      fi;
#endif
      d_step { taken = taken + slots; slots = 0; body = 0; early = 0 }
    od;
ended:
    skip
  } unless { dead[CONSUMER] }
}

active proctype Killer() {
  if
  :: dead[PRODUCER] = true
  :: dead[CONSUMER] = true
  :: skip
  fi
}
