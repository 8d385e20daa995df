#pragma once

#include <functional>
#include <string>

#include "runtime/log.hpp"

namespace km::log {

struct Entry {
  Level level = Level::kInfo;
  std::string tag, text;
};

using Listener = std::function<void(const Entry&)>;

/// `listener` receives every line written from now on, one at a time, on the thread that writes it:
/// it must only enqueue, and not log. An empty one removes the listener. Thread-safe; after the
/// return the former listener is not called any more.
void set_listener(Listener listener);

}  // namespace km::log
