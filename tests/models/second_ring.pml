// SPDX-License-Identifier: MIT
// Second ring: a ring that continues in a second one when it is full and the consumer has given
// the second one memory, with weak memory. Either process may be killed before any step.
//
//   MODELS  shm/ring.h: RingProducer tryPush hasFree tryMove
//   MODELS  shm/ring_consumer.h: RingConsumer hasMessage sequence tryMove begin end
//   MODELS  shm/link.cpp: tryAllowMore
//   HOLDS   each message arrives once and in order, whenever the second ring gets its memory; no
//           message waits forever
//   HOLDS   the second ring is not used before it has memory
//   HOLDS   after the death of a producer, exactly the messages with a completed release store
//           arrive
//   ASSUMES rings of 2 and 3 slots, 6 messages of one slot (ring.pml: longer ones); the second ring
//           may get its memory before any of them, or never
//   BREAK   MOVE_UNASKED    the producer moves although the second ring has no memory
//   BREAK   ALLOWED_EARLY   the consumer says that there is memory before it has reserved it
//   BREAK   NO_SPARE_SLOT   the producer fills the slot that says where the ring continues
//   BREAK   BEGINS_AT_ZERO  the consumer looks for the first message in the second ring's slot 0
#define FIRST 2
#define SECOND 3
#define MESSAGES 6
#define CONTINUES 100
#ifdef NO_SPARE_SLOT
#define USABLE FIRST
#else
#define USABLE (FIRST - 1)
#endif

#define PRODUCER 0
#define CONSUMER 1
#define PROCESSES 2
#define SLOT(moved, position) (moved -> FIRST + (position) % SECOND : (position) % FIRST)
#define SEQUENCE(moved, position) SLOT(moved, position)
#define BODY(moved, position) (FIRST + SECOND + SLOT(moved, position))
#define FREED (2 * (FIRST + SECOND))
#define HAS_MEMORY (FREED + 1)
#define WORDS (FREED + 2)
#define FLUSH_ALL \
  FLUSH(PRODUCER, 0) FLUSH(PRODUCER, 1) FLUSH(PRODUCER, 2) FLUSH(PRODUCER, 3) \
  FLUSH(PRODUCER, 4) FLUSH(PRODUCER, 5) FLUSH(PRODUCER, 6) FLUSH(PRODUCER, 7) \
  FLUSH(PRODUCER, 8) FLUSH(PRODUCER, 9) \
  FLUSH(CONSUMER, FREED) FLUSH(CONSUMER, HAS_MEMORY)
#include "memory.pml"

bool reserved;  // the second ring has memory
byte sent;      // messages with a completed release store

#define hasFree (pushed + 1 - freedSeen <= (moved -> SECOND : USABLE))
#ifdef MOVE_UNASKED
#define mayMove (!moved)
#else
#define mayMove (!moved && memory[HAS_MEMORY] != 0)
#endif

inline move() {
  storeRelease(PRODUCER, SEQUENCE(0, pushed), CONTINUES + pushed + 1);
  d_step { moved = 1; freedSeen = pushed }
}

active proctype Producer() {
  byte pushed, freedSeen;
  bit moved;
  {
    do
    :: pushed == MESSAGES -> break
    :: pushed < MESSAGES ->
      do
      :: hasFree -> break
      :: d_step { !hasFree && memory[FREED] > freedSeen -> freedSeen = memory[FREED] }
      :: !hasFree && mayMove -> move()
      :: !hasFree && isGone(CONSUMER) -> goto ended
      od;
      assert(!moved || reserved);
      store(PRODUCER, BODY(moved, pushed), pushed + 1);
      atomic { storeRelease(PRODUCER, SEQUENCE(moved, pushed), pushed + 1); sent++ };
      pushed++
    od;
ended:
    skip
  } unless { dead[PRODUCER] }
}

#ifdef BEGINS_AT_ZERO
#define position (moved -> taken - movedAt : taken)
#else
#define position taken
#endif
#define sequence memory[SEQUENCE(moved, position)]
#define continues (!moved && allowed && memory[SEQUENCE(0, taken)] == CONTINUES + taken + 1)
#define hasMessage (sequence == taken + 1)

inline allowMore() {
#ifdef ALLOWED_EARLY
  storeRelease(CONSUMER, HAS_MEMORY, 1);
  reserved = 1;
#else
  reserved = 1;
  storeRelease(CONSUMER, HAS_MEMORY, 1);
#endif
  allowed = 1
}

active proctype Consumer() {
  byte taken, movedAt;
  bit moved, allowed;
  {
    do
    :: taken == MESSAGES -> break
    :: taken < MESSAGES && !allowed -> allowMore()
    :: taken < MESSAGES && hasMessage ->
      assert(memory[BODY(moved, position)] == taken + 1);
      taken++;
      storeRelease(CONSUMER, FREED, taken)
    :: continues -> d_step { moved = 1; movedAt = taken }
    :: isGone(PRODUCER) && taken < MESSAGES && !hasMessage && !continues && (allowed || sequence <= CONTINUES) ->
      assert(taken == sent);
      break
    od
  } unless { dead[CONSUMER] }
}

active proctype Killer() {
  if
  :: dead[PRODUCER] = true
  :: dead[CONSUMER] = true
  :: skip
  fi
}
