#include "runtime/log.hpp"

#include <sys/ioctl.h>
#include <unistd.h>
#include <array>
#include <atomic>
#include <chrono>
#include <ctime>
#include <mutex>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/unblocked_output.hpp"

namespace km {

RateLimit::Verdict RateLimit::ask(const std::string& key, double now_s) {
  constexpr std::size_t kMaxKeys = 1000;  // bounded, because keys may contain text of other robots
  if (entries_.size() >= kMaxKeys && !entries_.contains(key)) entries_.clear();
  const auto [entry, fresh] = entries_.try_emplace(key, Entry{now_s, 0});
  if (fresh) return {true, 0};
  Entry& e = entry->second;
  if (now_s - e.last_s < interval_s_) {
    ++e.held_back;
    return {false, 0};
  }
  const int held_back = e.held_back;
  e = {now_s, 0};
  return {true, held_back};
}

namespace {

constexpr double kLimitedInterval_s = 5.0;

// The terminal is one per process, and so is this: log lines and the status line share it.
struct Console {
  std::mutex mutex;  // guards the members below
  std::ostream* log_output = &unblocked_stderr();
  std::function<void(const log::Entry&)> listener;
  RateLimit rate_limit{kLimitedInterval_s};
  std::ostream* status_output = nullptr;
  bool status_in_place = false;
  bool status_measures_width = false;
  double plain_interval_s = 5.0;
  double last_plain_s = -1e9;
  std::string status;  // the last one given
  std::string drawn;   // text that is on the screen or was printed last
};

Console& console() {
  static Console instance;
  return instance;
}

std::atomic<log::Level>& level_limit() {
  static std::atomic<log::Level> limit = log::Level::kInfo;
  return limit;
}

std::string time_of_day() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm local{};
  localtime_r(&seconds, &local);
  std::array<char, 32> text{};
  const std::size_t n = std::strftime(text.data(), text.size(), "%H:%M:%S", &local);
  std::snprintf(text.data() + n, text.size() - n, ".%03d", static_cast<int>(ms));
  return text.data();
}

const char* name_of(log::Level level) {
  constexpr std::array kNames = {"error", "warn", "info", "debug"};  // as the enumerators
  return kNames[static_cast<std::size_t>(level)];
}

void erase_status(Console& c) {
  if (c.status_in_place && !c.drawn.empty()) *c.status_output << "\r\033[K" << std::flush;
}

void draw_status(Console& c) {
  winsize size{};
  std::string text = c.status;
  if (c.status_measures_width && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1)
    text.resize(std::min<std::size_t>(text.size(), size.ws_col - 1U));
  *c.status_output << "\r\033[K" << text << std::flush;
  c.drawn = text;
}

void print_status(Console& c) {
  *c.status_output << c.status << std::endl;
  c.drawn = c.status;
  c.last_plain_s = steady_now_s();
}

}  // namespace

namespace log {

Line::Line(Level level, std::string_view tag, std::string key)
    : level_(level), tag_(tag), key_(std::move(key)), enabled_(level <= level_limit()) {}

Line::~Line() {
  if (!enabled_) return;
  Console& c = console();
  const std::lock_guard lock(c.mutex);
  if (!key_.empty()) {
    const auto verdict = c.rate_limit.ask(tag_ + '/' + key_, steady_now_s());
    if (!verdict.pass) return;
    if (verdict.held_back > 0) text_ << " (" << verdict.held_back << " more such lines before)";
  }
  erase_status(c);
  *c.log_output << time_of_day() + ' ' + name_of(level_) + ' ' + tag_ + ": " + text_.str() + '\n'
                << std::flush;
  if (c.status_in_place && !c.drawn.empty()) draw_status(c);
  if (c.listener) c.listener({level_, tag_, text_.str()});
}

void set_listener(std::function<void(const Entry&)> listener) {
  const std::lock_guard lock(console().mutex);
  console().listener = std::move(listener);
}

void set_level(Level level) {
  level_limit() = level;
}

std::ostream* set_output(std::ostream* output) {
  const std::lock_guard lock(console().mutex);
  return std::exchange(console().log_output, output);
}

}  // namespace log

StatusLine::StatusLine() : StatusLine(unblocked_stdout(), isatty(STDOUT_FILENO) == 1) {
  const std::lock_guard lock(console().mutex);
  console().status_measures_width = console().status_in_place;
}

StatusLine::StatusLine(std::ostream& output, bool terminal, double plain_interval_s) {
  Console& c = console();
  const std::lock_guard lock(c.mutex);
  c.status_output = &output;
  c.status_in_place = terminal;
  c.status_measures_width = false;
  c.plain_interval_s = plain_interval_s;
  c.last_plain_s = -1e9;
  c.status.clear();
  c.drawn.clear();
}

StatusLine::~StatusLine() {
  Console& c = console();
  const std::lock_guard lock(c.mutex);
  if (c.status_in_place && !c.drawn.empty()) *c.status_output << std::endl;
  if (!c.status_in_place && c.status != c.drawn) print_status(c);
  c.status_output = nullptr;
  c.status_in_place = false;
  c.drawn.clear();
}

void StatusLine::update(const std::string& text) {
  Console& c = console();
  const std::lock_guard lock(c.mutex);
  c.status = text;
  if (c.status_in_place) {
    draw_status(c);
  } else if (steady_now_s() - c.last_plain_s >= c.plain_interval_s) {
    print_status(c);
  }
}

}  // namespace km
