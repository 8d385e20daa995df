#include "apps/team/emulated_links.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr const char* kInterface = "eth0";
constexpr const char* kTunDevice = "/dev/net/tun";
constexpr std::size_t kHosts = 250;  // values of the last number of an address
constexpr std::size_t kMaxDescriptors = 3;

// "10.77.0.1" for robot 0.
std::string network_address(std::size_t robot) {
  return "10.77." + std::to_string(robot / kHosts) + '.' + std::to_string(robot % kHosts + 1);
}

struct NetworkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

void require(bool ok, const std::string& what) {
  if (!ok) throw NetworkError(what + ": " + std::generic_category().message(errno));
}

void write_setting(const std::string& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text << std::flush;
  require(stream.good(), file);
}

// Enters a user namespace as the same user, so that files of the robots belong to that user.
void enter_user_namespace() {
  const std::string user = std::to_string(geteuid()), group = std::to_string(getegid());
  require(unshare(CLONE_NEWUSER) == 0, "a user namespace");
  write_setting("/proc/self/setgroups", "deny");
  write_setting("/proc/self/uid_map", user + ' ' + user + " 1");
  write_setting("/proc/self/gid_map", group + ' ' + group + " 1");
}

ifreq request_for(const char* interface) {
  ifreq request{};
  std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
  return request;
}

void set_up(int socket, const char* interface) {
  ifreq request = request_for(interface);
  require(ioctl(socket, SIOCGIFFLAGS, &request) == 0, interface);
  request.ifr_flags |= IFF_UP;  // keeps multicast, which DDS needs
  require(ioctl(socket, SIOCSIFFLAGS, &request) == 0, std::string(interface) + " up");
}

void set_address(int socket, unsigned long what, const std::string& address) {
  ifreq request = request_for(kInterface);
  sockaddr_in ip{};
  ip.sin_family = AF_INET;
  inet_pton(AF_INET, address.c_str(), &ip.sin_addr);
  std::memcpy(&request.ifr_addr, &ip, sizeof ip);
  require(ioctl(socket, what, &request) == 0, "address " + address);
}

Descriptor make_tap(std::size_t robot) {
  Descriptor tap(open(kTunDevice, O_RDWR | O_NONBLOCK | O_CLOEXEC));
  require(tap.get() >= 0, kTunDevice);
  ifreq request = request_for(kInterface);
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  require(ioctl(tap.get(), TUNSETIFF, &request) == 0, "a TAP device");
  // The device ends with the namespace and not with its descriptor, because DDS cannot shut down
  // without its address.
  require(ioctl(tap.get(), TUNSETPERSIST, 1) == 0, "a TAP device that stays");

  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  require(socket.get() >= 0, "a socket");
  request = request_for(kInterface);
  request.ifr_hwaddr.sa_family = ARPHRD_ETHER;
  const auto address = ethernet_address(robot);
  std::memcpy(request.ifr_hwaddr.sa_data, address.data(), address.size());
  require(ioctl(socket.get(), SIOCSIFHWADDR, &request) == 0, "an Ethernet address");
  set_address(socket.get(), SIOCSIFADDR, network_address(robot));
  set_address(socket.get(), SIOCSIFNETMASK, "255.255.0.0");
  set_up(socket.get(), "lo");
  set_up(socket.get(), kInterface);
  return tap;
}

// A message with descriptors, or with the text of an error.
struct Answer {
  std::array<char, 512> text{};
  std::array<int, kMaxDescriptors> descriptors{-1, -1, -1};
  std::size_t count = 0;
};

// Common part of sendmsg() and recvmsg().
struct Envelope {
  explicit Envelope(Answer& answer) : text{answer.text.data(), answer.text.size()} {
    message.msg_iov = &text;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
  }
  iovec text;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxDescriptors * sizeof(int))> control{};
  msghdr message{};
};

void send_answer(int socket, Answer& answer) {
  Envelope envelope(answer);
  const std::size_t bytes = answer.count * sizeof(int);
  envelope.message.msg_controllen = answer.count == 0 ? 0 : CMSG_SPACE(bytes);
  if (cmsghdr* const header = CMSG_FIRSTHDR(&envelope.message); header != nullptr) {
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(bytes);
    std::memcpy(CMSG_DATA(header), answer.descriptors.data(), bytes);
  }
  [[maybe_unused]] const ssize_t sent = sendmsg(socket, &envelope.message, MSG_NOSIGNAL);
}

Answer receive_answer(int socket) {
  Answer answer;
  Envelope envelope(answer);
  ssize_t received = -1;
  do received = recvmsg(socket, &envelope.message, MSG_CMSG_CLOEXEC);
  while (received < 0 && errno == EINTR);
  require(received > 0, "the process that makes it");
  if (const cmsghdr* const header = CMSG_FIRSTHDR(&envelope.message); header != nullptr) {
    answer.count = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    std::memcpy(answer.descriptors.data(), CMSG_DATA(header), answer.count * sizeof(int));
  }
  return answer;
}

// Runs in a process of its own: makes the network and sends its descriptors.
[[noreturn]] void make_and_pass(int socket, std::size_t robot) {
  Answer answer;
  try {
    const bool as_root = unshare(CLONE_NEWNET) == 0;
    if (!as_root) {
      enter_user_namespace();
      require(unshare(CLONE_NEWNET) == 0, "a network namespace");
    }
    const Descriptor tap = make_tap(robot);
    const Descriptor network(open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC));
    require(network.get() >= 0, "/proc/self/ns/net");
    const Descriptor user(as_root ? -1 : open("/proc/self/ns/user", O_RDONLY | O_CLOEXEC));
    require(as_root || user.get() >= 0, "/proc/self/ns/user");
    answer.descriptors = {tap.get(), network.get(), user.get()};
    answer.count = as_root ? 2 : 3;
    send_answer(socket, answer);
  } catch (const std::exception& error) {
    std::strncpy(answer.text.data(), error.what(), answer.text.size() - 1);
    send_answer(socket, answer);
  }
  _exit(0);
}

}  // namespace

RobotNetwork::RobotNetwork(std::size_t robot) try {
  std::array<int, 2> ends{};
  require(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) == 0, "a socket");
  const Descriptor own(ends[0]);
  Descriptor other(ends[1]);
  const pid_t maker = fork();
  require(maker >= 0, "a process");
  if (maker == 0) make_and_pass(other.get(), robot);
  other = Descriptor();
  const Answer answer = receive_answer(own.get());
  waitpid(maker, nullptr, 0);
  tap_ = Descriptor(answer.descriptors[0]);
  network_ = Descriptor(answer.descriptors[1]);
  user_ = Descriptor(answer.descriptors[2]);
  if (answer.text.front() != '\0') throw NetworkError(answer.text.data());
} catch (const NetworkError& error) {
  throw std::runtime_error(
      std::string("robots cannot have networks of their own here (") + error.what() +
      "): be root, or allow user namespaces, with access to /dev/net/tun; in a container "
      "--cap-add SYS_ADMIN,NET_ADMIN --device /dev/net/tun, or --privileged");
}

bool RobotNetwork::enter() const {
  return (user_.get() < 0 || setns(user_.get(), CLONE_NEWUSER) == 0) &&
         setns(network_.get(), CLONE_NEWNET) == 0;
}

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
