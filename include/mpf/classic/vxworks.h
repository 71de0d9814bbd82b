// SPDX-License-Identifier: MIT
// The few calls of vxWorks that servers of the original MPF use: tasks, delays, semaphores.
//
// A task is a thread of the process. It has no priority of its own, and its stack has the size that
// is usual on this host. The clock has 60 ticks a second.
//
// Threads  any.
// Source   vxWorks Programmer's Guide 5.3; manual, "EXAMPLE Implementation: ip330Scan".
#pragma once

#include <cstdint>

// NOLINTBEGIN(readability-identifier-naming): names of vxWorks

#ifndef OK
#define OK 0
#endif
#ifndef ERROR
#define ERROR (-1)
#endif
#ifndef TRUE
#define TRUE 1
#endif
#ifndef FALSE
#define FALSE 0
#endif

#define VX_FP_TASK 0x0008  // an option of taskSpawn(): has no effect
#define NO_WAIT 0
#define WAIT_FOREVER (-1)
#define SEM_Q_FIFO 0x0  // options of semBCreate() and semMCreate(): have no effect
#define SEM_Q_PRIORITY 0x1
#define SEM_DELETE_SAFE 0x4
#define SEM_INVERSION_SAFE 0x8

typedef std::uint8_t UINT8;
typedef std::uint16_t UINT16;
typedef std::uint32_t UINT32;
typedef int STATUS;
typedef int BOOL;
typedef int (*FUNCPTR)(...);
typedef void (*VOIDFUNCPTR)(...);

namespace mpf::classic {

// What a task is given: an integer, or a pointer that old sources cast to int.
typedef std::intptr_t Word;

// Starts a thread that calls entry(words[0], ..., words[9]).
//   name     nullptr: "t" and the number of the task
//   returns  a number above 0, or ERROR
int spawnTask(const char* name, FUNCPTR entry, const Word (&words)[10]);

// Replaces the cast `(int)pointer` in the arguments of taskSpawn(), which loses half of the pointer
// where pointers have 64 bits: see MPF_CLASSIC_WORD.
struct WordCast {
  template <class T>
  friend Word operator->*(WordCast, T* pointer) {
    return reinterpret_cast<Word>(pointer);
  }
  friend constexpr Word operator->*(WordCast, int value) { return value; }
};

}  // namespace mpf::classic

// `(int)p` becomes `WordCast{} ->* p`; any other argument stays what it is. A macro cannot compare
// tokens, but it can see whether one is another macro: the type between the parentheses is appended
// to MPF_CLASSIC_IS_, and only MPF_CLASSIC_IS_int expands to something with a comma.
#define MPF_CLASSIC_IS_int ~, 1
#define MPF_CLASSIC_TYPE(type) MPF_CLASSIC_IS_##type, 0,
#define MPF_CLASSIC_DROP(type)
#define MPF_CLASSIC_SECOND(first, second, ...) second
#define MPF_CLASSIC_SELECT(...) MPF_CLASSIC_SECOND(__VA_ARGS__)
#define MPF_CLASSIC_USE_0(argument) argument
#define MPF_CLASSIC_USE_1(argument) mpf::classic::WordCast{}->*MPF_CLASSIC_DROP argument
#define MPF_CLASSIC_JOIN(left, right) left##right
#define MPF_CLASSIC_CHOOSE(is, argument) MPF_CLASSIC_JOIN(MPF_CLASSIC_USE_, is)(argument)
#define MPF_CLASSIC_WORD(argument) \
  MPF_CLASSIC_CHOOSE(MPF_CLASSIC_SELECT(MPF_CLASSIC_TYPE argument, 0, 0), argument)

// Starts a task with ten arguments. `(int)pointer` arrives as the whole pointer.
//   returns  its number, or ERROR
#define taskSpawn(name, priority, options, stackBytes, entry, a1, a2, a3, a4, a5, a6, a7, a8, a9, \
                  a10)                                                                            \
  (static_cast<void>(priority), static_cast<void>(options), static_cast<void>(stackBytes),        \
   mpf::classic::spawnTask(                                                                       \
       name, entry,                                                                               \
       {MPF_CLASSIC_WORD(a1), MPF_CLASSIC_WORD(a2), MPF_CLASSIC_WORD(a3), MPF_CLASSIC_WORD(a4),   \
        MPF_CLASSIC_WORD(a5), MPF_CLASSIC_WORD(a6), MPF_CLASSIC_WORD(a7), MPF_CLASSIC_WORD(a8),   \
        MPF_CLASSIC_WORD(a9), MPF_CLASSIC_WORD(a10)}))

// Waits for a number of ticks.
STATUS taskDelay(int ticks);
// Ticks in a second: 60.
int sysClkRateGet();
// Ticks since the host started.
unsigned long tickGet();

// A binary semaphore, or a mutex that its owner may take several times.
typedef struct MpfClassicSemaphore* SEM_ID;
enum SEM_B_STATE { SEM_EMPTY, SEM_FULL };
SEM_ID semBCreate(int options, SEM_B_STATE initialState);
SEM_ID semMCreate(int options);
//   timeout  ticks, NO_WAIT or WAIT_FOREVER
//   returns  OK, or ERROR after the timeout
STATUS semTake(SEM_ID semaphore, int timeout);
//   returns  OK, or ERROR when another thread owns the mutex
STATUS semGive(SEM_ID semaphore);
STATUS semDelete(SEM_ID semaphore);

// NOLINTEND(readability-identifier-naming)
