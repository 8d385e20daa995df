#include "apps/team/robot_network.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "modules/link_emulation/link_emulator.hpp"

namespace km {
namespace {

constexpr const char* kInterface = "eth0";
constexpr const char* kTunDevice = "/dev/net/tun";
constexpr std::size_t kHosts = 250;  // values of the last number of an address
constexpr std::size_t kMaxDescriptors = 3;

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

std::string network_address(std::size_t robot) {
  return "10.77." + std::to_string(robot / kHosts) + '.' + std::to_string(robot % kHosts + 1);
}

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

}  // namespace km
