// SPDX-License-Identifier: MIT
// Reclaim: starters, which want the name of a server, and reapers, which remove the window of a
// dead owner that has this name. Each process may be killed before any step.
//
//   owner   create file ─ lock it ─ link it to the name ─ ... ─ remove the name ─ unlock
//           (the kernel unlocks the file of a dead owner)
//   reaper  open by name ─ lock byte 1 of that file, or lock a reaper file if strangers hold locks
//           ─ does the name still refer to the file? ─ remove the name ─ unlock
//
//   MODELS  shm/segment.cpp: lockForLife tryPublish removeIfOwnerless isOwned isNameOf probeOwner
//   MODELS  shm/owner_lock.cpp: trySet isHeld isHeldByOwner Reaper tryBesideStrangers
//   MODELS  shm/owner_lock.cpp: lockReaperFile isReaperFileLocked findWriteLock
//   MODELS  shm/window.cpp: publish checkConflict ~OwnWindow
//   HOLDS   only its owner removes the name of a living window
//   HOLDS   two living processes never own the name at the same time
//   HOLDS   a process that wants the name gets it, or is refused because a living process has it.
//           No death leaves the name blocked; a stranger that locks the file of a dead owner, and
//           keeps the lock, does not block it either
//   ASSUMES link, unlink and the lock of a file are single steps; the kernel releases a lock some
//           time after the death of its holder
//   ASSUMES locking a reaper file and checking that it still has its name is one step:
//           lockReaperFile() gives up if it has lost its name
//   ASSUMES a starter waits longer than a reaper that removes a dead window, and longer than the
//           kernel (it waits 50 ms for some microseconds)
//   ASSUMES three starters, each also a reaper, and one process that only reaps; two of them are
//           killed; no other process removes names
//   BREAK   NO_COMPARE    a reaper does not check that the name still refers to the locked file
//   BREAK   NO_LOCK       a reaper tests the lock but does not place it
//   BREAK   ONE_LOCK      a reaper locks the file as an owner does
//   BREAK   UNLOCK_EARLY  a reaper releases the lock before it removes the name
//   BREAK   LOCK_LATE     a starter locks its window after the window has its name
//   BREAK   LEAVE_LATE    an owner that leaves releases the lock before it removes its name
//   BREAK   NO_REAPING    a starter waits for others to remove dead windows
//   BREAK   NO_BESIDE     there is no reaper file: a reaper needs byte 1
//   BREAK   NO_LOOK       a reaper that has locked byte 1 does not look at the reaper file
#define STARTERS 3
#define REAPER 3
#define PROCESSES 4
#define NO_FILE 0
#define FREE 255
#define fileOf(starter) ((starter) + 1)

byte name = NO_FILE;       // the file that the name refers to
byte lock[STARTERS + 1];   // of each file: the process that holds the owner's lock
byte reaper[STARTERS + 1]; // of each file: the process that holds the lock on byte 1
byte beside[STARTERS + 1]; // of each file: the process that has locked its reaper file
bool stranger[STARTERS + 1]; // of each file: a stranger has a lock, of either kind, on it
bool left[STARTERS];
bool dead[PROCESSES];

#define isLiving(file) (!dead[(file) - 1] && !left[(file) - 1])
#define isOwned (name != NO_FILE && isLiving(name))
#define isLocked (name != NO_FILE && lock[name] != FREE && !dead[lock[name]])
#ifdef ONE_LOCK
#define reaperOf lock
#else
#define reaperOf reaper
#endif

inline removeName(mayBe) {
  atomic {
    assert(name == mayBe || !isOwned);
    name = NO_FILE
  }
}

#define isByteFree(file) (lock[file] == FREE && reaperOf[file] == FREE && !stranger[file])

// Locks byte 1 or the reaper file. Sets `mine`.
inline becomeReaper(me) {
  if
#ifdef NO_LOCK
  :: isByteFree(file) -> mine = true
#else
  :: d_step { isByteFree(file) -> reaperOf[file] = me } ->
#ifdef NO_LOOK
    mine = true
#else
    if
    :: d_step { beside[file] == FREE -> mine = true }
    :: beside[file] != FREE -> reaperOf[file] = FREE
    fi
#endif
#endif
#if !defined(NO_BESIDE) && !defined(NO_LOCK)
  :: d_step { lock[file] == FREE && !isByteFree(file) && beside[file] == FREE -> beside[file] = me } ->
    if
    :: d_step { reaperOf[file] == FREE -> mine = true }
    :: reaperOf[file] != FREE -> beside[file] = FREE
    fi
#endif
  :: else
  fi
}

inline stopReaping(me) {
  if
  :: reaperOf[file] == me -> reaperOf[file] = FREE
  :: else
  fi;
  if
  :: beside[file] == me -> beside[file] = FREE
  :: else
  fi
}

inline removeIfOwnerless(me) {
  file = name;  // open
  if
  :: file == NO_FILE
  :: file != NO_FILE ->
    becomeReaper(me);
    if
    :: mine ->
#ifndef NO_COMPARE
      if
      :: name == file ->
#endif
#ifdef UNLOCK_EARLY
        d_step { stopReaping(me) };
#endif
        removeName(NO_FILE)
#ifndef NO_COMPARE
      :: name != file
      fi;
#else
      ;
#endif
      d_step { stopReaping(me); mine = false }
    :: else
    fi
  fi;
  file = NO_FILE
}

// Whether a reaper can continue: another reaper, or the kernel, releases that reaper's locks.
#ifdef NO_BESIDE
#define isReapable(file) (lock[file] == FREE && !stranger[file])
#else
#define isReapable(file) (lock[file] == FREE)
#endif

proctype Starter(byte me) {
  byte file;
  bool mine;
  {
#ifndef LOCK_LATE
    lock[fileOf(me)] = me;
#endif
    do
    :: d_step { name == NO_FILE -> name = fileOf(me) } -> goto owner
    :: atomic {
         isLocked -> assert(isLiving(name));
         left[me] = true;
         lock[fileOf(me)] = FREE
       } -> goto done  // refused
#ifndef NO_REAPING
    :: name != NO_FILE && isReapable(name) -> removeIfOwnerless(me)
#endif
    od;
owner:
#ifdef LOCK_LATE
    lock[fileOf(me)] = me;
#endif
#ifndef LEAVE_LATE
    removeName(fileOf(me));  // at any time
#endif
    atomic { left[me] = true; lock[fileOf(me)] = FREE };
#ifdef LEAVE_LATE
    removeName(fileOf(me));
#endif
done:
    skip
  } unless { dead[me] }
}

active proctype Reaper() {
  byte file;
  bool mine;
  {
    removeIfOwnerless(REAPER)
  } unless { dead[REAPER] }
}

// A process that may read or write the first starter's file locks it once, and releases the lock or
// keeps it.
#define LOCKED 1
active proctype Stranger() {
  if
  :: d_step { name == LOCKED && isByteFree(LOCKED) -> stranger[LOCKED] = true }
  :: skip -> goto done
  fi;
  if
  :: stranger[LOCKED] = false
  :: skip
  fi;
done:
  skip
}

inline kill(process) {
  dead[process] = true;
  d_step {
    file = 1;
    do
    :: file <= STARTERS ->
      if
      :: lock[file] == process -> lock[file] = FREE
      :: else
      fi;
      if
      :: reaper[file] == process -> reaper[file] = FREE
      :: else
      fi;
      if
      :: beside[file] == process -> beside[file] = FREE
      :: else
      fi;
      file++
    :: else -> break
    od;
    file = 0
  }
}

active proctype Killer() {
  byte file, kills;
  do
  :: kills < 2 && !dead[0] -> kill(0); kills++
  :: kills < 2 && !dead[1] -> kill(1); kills++
  :: kills < 2 && !dead[REAPER] -> kill(REAPER); kills++
  :: break
  od
}

init {
  atomic {
    lock[1] = FREE;
    lock[2] = FREE;
    lock[3] = FREE;
    reaper[1] = FREE;
    reaper[2] = FREE;
    reaper[3] = FREE;
    beside[1] = FREE;
    beside[2] = FREE;
    beside[3] = FREE;
    run Starter(0);
    run Starter(1);
    run Starter(2)
  }
}
