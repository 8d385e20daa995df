#pragma once

#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/log.hpp"

namespace km {

/// Redirects the log during its lifetime.
class CapturedLog {
 public:
  CapturedLog() : previous_(log::set_output(&text_)) {}
  ~CapturedLog() { log::set_output(previous_); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;

  [[nodiscard]] std::vector<std::string> lines() const {
    std::vector<std::string> result;
    std::istringstream input(text_.str());
    for (std::string line; std::getline(input, line);) result.push_back(line);
    return result;
  }
  [[nodiscard]] std::string text() const { return text_.str(); }
  [[nodiscard]] std::ostringstream& stream() { return text_; }

 private:
  std::ostringstream text_;
  std::ostream* previous_;
};

}  // namespace km
