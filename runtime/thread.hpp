#pragma once

#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <utility>

namespace km {

/// The calling thread, and threads that it starts from now on, receive no signals of the process,
/// because another thread handles them. Returns the signals that were blocked before.
inline sigset_t block_signals() {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  return before;
}

/// Starts a thread that receives no signals of the process.
template <typename Work>
[[nodiscard]] std::thread start_without_signals(Work&& work) {
  const sigset_t before = block_signals();
  std::thread thread(std::forward<Work>(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

/// Names the calling thread for debuggers and top; Linux keeps 15 characters.
inline void name_this_thread(const std::string& name) {
  if (!name.empty()) pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
}

/// Number of the calling thread in /proc/self/task.
inline pid_t this_thread_id() {
  static thread_local const pid_t id = gettid();
  return id;
}

/// False in a process whose input waits for it, as a recording does that is played as fast as
/// possible. None of its work is urgent, so a lower priority would only let other processes pass.
/// Set it before the first thread of such work starts.
inline std::atomic<bool> has_urgent_work = true;

/// Lowers the priority of the calling thread if has_urgent_work. If processors are scarce, Linux
/// gives it about a tenth of the time of an ordinary thread. For handlers of work that may be late,
/// so that it does not slow down urgent work. Later calls have no effect.
inline void work_in_background() {
  static thread_local const int outcome = [] {
    if (!has_urgent_work) return 0;
    constexpr int kNiceness = 10;
    const auto self = static_cast<id_t>(this_thread_id());
    return setpriority(PRIO_PROCESS, self, std::max(kNiceness, getpriority(PRIO_PROCESS, self)));
  }();
  static_cast<void>(outcome);  // if not permitted, the thread keeps its priority
}

}  // namespace km
