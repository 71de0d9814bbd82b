// SPDX-License-Identifier: MIT
// Reclaim: starters, which take the name of a server, and reapers, which remove the window that a
// dead owner left under it. Each may be killed before any step.
//
//   file created ─ locked for life ─ linked to the name ─ ... ─ name removed ─ unlocked          a dead owner: unlocked by the kernel
//   reaper: open by name ─ lock a byte that a living owner has locked ─ does the name still refer to this file?
//           ─ remove the name ─ unlock
//
//   MODELS  shm/segment.cpp: lockForLife tryPublish removeIfOwnerless tryLockAsOwner tryLockAsReaper isOwned probeOwner
//   MODELS  shm/window.cpp: publish checkInTheWay ~OwnWindow
//   HOLDS   only its owner removes the name of a living window
//   HOLDS   two living processes never own the name at the same time
//   HOLDS   a starter gets the name, or is refused because a living process has it: no death blocks
//           the name
//   ASSUMES link, unlink and the lock of a file are single steps; the kernel drops a lock some time
//   after the death of its holder ASSUMES a starter waits longer than a reaper or the kernel needs
//   (50 ms for some microseconds) ASSUMES three starters, each also a reaper, and one reaper; two
//   of them are killed; no other process removes names
//   BREAK   NO_COMPARE    a reaper does not check whether the name still refers to the file that it locked
//   BREAK   NO_LOCK       a reaper tests the lock and does not take it
//   BREAK   ONE_LOCK      a reaper locks the file as an owner does
//   BREAK   UNLOCK_EARLY  a reaper releases the lock before it removes the name
//   BREAK   LOCK_LATE     a starter locks its window after the window has its name
//   BREAK   LEAVE_LATE    a leaving owner releases the lock before it removes the name
//   BREAK   NO_REAPING    a starter waits until another process has removed a dead window
#define STARTERS 3
#define REAPER 3
#define PROCESSES 4
#define NO_FILE 0
#define FREE 255
#define fileOf(starter) ((starter) + 1)

byte name = NO_FILE;       // the file that the name refers to
byte lock[STARTERS + 1];   // index: file; the owner that holds its lock
byte reaper[STARTERS + 1]; // index: file; the reaper that is about to remove its name
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

inline removeIfOwnerless(me) {
  file = name;  // open
  if
  :: file == NO_FILE
  :: file != NO_FILE ->
    if
#ifdef NO_LOCK
    :: lock[file] == FREE ->
#else
    :: d_step { lock[file] == FREE && reaperOf[file] == FREE -> reaperOf[file] = me } ->
#endif
#ifndef NO_COMPARE
      if
      :: name == file ->
#endif
#ifdef UNLOCK_EARLY
        reaperOf[file] = FREE;
#endif
        removeName(NO_FILE)
#ifndef NO_COMPARE
      :: name != file
      fi;
#else
      ;
#endif
#if !defined(UNLOCK_EARLY) && !defined(NO_LOCK)
      reaperOf[file] = FREE
#else
      skip
#endif
    :: else
    fi
  fi;
  file = NO_FILE
}

proctype Starter(byte me) {
  byte file;
  {
#ifndef LOCK_LATE
    lock[fileOf(me)] = me;
#endif
    do
    :: d_step { name == NO_FILE -> name = fileOf(me) } -> goto owner
    :: atomic { isLocked -> assert(isLiving(name)) } -> goto refused
#ifndef NO_REAPING
    :: name != NO_FILE && lock[name] == FREE -> removeIfOwnerless(me)
#endif
    od;
owner:
#ifdef LOCK_LATE
    lock[fileOf(me)] = me;
#endif
    // Two owners would be two living processes that got the name.
    assert(name == fileOf(me));
    if
    :: skip  // may leave at any time
    :: dead[me]
    fi;
#ifdef LEAVE_LATE
    d_step { left[me] = true; lock[fileOf(me)] = FREE };
    removeName(fileOf(me));
#else
    removeName(fileOf(me));
    d_step { left[me] = true; lock[fileOf(me)] = FREE };
#endif
refused:
    skip;
    d_step { left[me] = true; lock[fileOf(me)] = FREE }
  } unless { dead[me] }
}

active proctype Reaper() {
  byte file;
  {
    removeIfOwnerless(REAPER)
  } unless { dead[REAPER] }
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
    run Starter(0);
    run Starter(1);
    run Starter(2)
  }
}
