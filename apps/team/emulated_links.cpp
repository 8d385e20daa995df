#include "apps/team/emulated_links.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxFrame_bytes = 65536;
constexpr int kFramesAtOnce = 64;  // frames taken from one robot before the next robot's turn

std::runtime_error carry_error(const std::string& what) {
  return std::runtime_error("links: " + what + ": " + std::generic_category().message(errno));
}

bool is_passing(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

}  // namespace

EmulatedLinks::EmulatedLinks(LinkScript script)
    : emulator_(std::move(script)), wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_.get() < 0) throw carry_error("eventfd");
  for (std::size_t robot = 0; robot < emulator_.robots(); ++robot) networks_.emplace_back(robot);
  start_s_ = steady_now_s();
  carrier_.start("links", [this] { carry(); });
}

EmulatedLinks::~EmulatedLinks() {
  stop();
}

const LinkEmulator& EmulatedLinks::finish() {
  stop();
  if (const auto failure = carrier_.error()) std::rethrow_exception(failure);
  return emulator_;
}

void EmulatedLinks::set_progress(std::size_t robot, double recorded_s) {
  const std::lock_guard lock(mutex_);
  emulator_.set_progress(robot, steady_now_s() - start_s_, recorded_s);
}

void EmulatedLinks::stop() {
  if (!carrier_.joinable()) return;
  stopped_ = true;
  eventfd_write(wake_.get(), 1);
  carrier_.join();
}

void EmulatedLinks::carry() {
  while (!stopped_) {
    std::optional<double> next_s;
    {
      const std::lock_guard lock(mutex_);
      const double now_s = steady_now_s() - start_s_;
      for (const SentFrame& delivery : emulator_.due(now_s)) deliver(delivery);
      for (std::size_t robot = 0; robot < networks_.size(); ++robot) take_frames(robot, now_s);
      next_s = emulator_.next_s();
    }
    if (next_s)
      wait_for_frames(*next_s - (steady_now_s() - start_s_));
    else
      wait_for_frames({});
  }
}

void EmulatedLinks::take_frames(std::size_t robot, double now_s) {
  std::array<char, kMaxFrame_bytes> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  for (int i = 0; i < kFramesAtOnce; ++i) {
    const ssize_t n = read(networks_[robot].frames(), buffer.data(), buffer.size());
    if (n < 0 && is_passing(errno)) return;
    if (n < 0) throw carry_error("reading frames of robot " + std::to_string(robot));
    emulator_.send(robot, now_s, EthernetFrame(buffer.data(), static_cast<std::size_t>(n)));
  }
}

void EmulatedLinks::deliver(const SentFrame& delivery) {
  const EthernetFrame& frame = delivery.frame;
  const ssize_t n = write(networks_[delivery.to].frames(), frame.data(), frame.size());
  // As on a wire, a robot that is too slow to take a frame, or has its interface down, loses it.
  if (n < 0 && !is_passing(errno) && errno != ENOBUFS && errno != ENOMEM && errno != EIO)
    throw carry_error("writing frames for robot " + std::to_string(delivery.to));
}

void EmulatedLinks::wait_for_frames(std::optional<double> due_in_s) {
  std::vector<pollfd> polled{{wake_.get(), POLLIN, 0}};
  for (const RobotNetwork& network : networks_) polled.push_back({network.frames(), POLLIN, 0});
  const double wait_s = std::clamp(due_in_s.value_or(1.0), 0.0, 1.0);
  const auto whole_s = std::floor(wait_s);
  const timespec limit{static_cast<time_t>(whole_s), static_cast<long>(1e9 * (wait_s - whole_s))};
  if (ppoll(polled.data(), polled.size(), &limit, nullptr) < 0 && errno != EINTR)
    throw carry_error("poll");
}

}  // namespace km
