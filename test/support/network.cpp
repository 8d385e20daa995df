#include "test/support/network.hpp"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <stdexcept>

#include "test/support/command.hpp"
#include "test/support/process.hpp"

namespace km {
namespace {

void end(pid_t process) {
  if (process <= 0) return;
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
}

// Starts a process that does nothing but own a new network namespace; 0 if it may not.
pid_t hold_namespace() {
  int ready[2];
  if (pipe(ready) != 0) throw std::runtime_error("VirtualNetwork: no pipe");
  const pid_t process = fork();
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const char answer = unshare(CLONE_NEWNET) == 0 ? 'y' : 'n';
    if (write(ready[1], &answer, 1) != 1) _exit(1);
    while (true) pause();
  }
  char answer = 'n';
  const bool received = read(ready[0], &answer, 1) == 1;
  close(ready[0]);
  close(ready[1]);
  if (received && answer == 'y') return process;
  end(process);
  return 0;
}

bool run_ip(pid_t network_of, const std::string& arguments) {
  return Process(words_of("ip " + arguments), network_of).wait() == 0;
}

void ip(pid_t network_of, const std::string& arguments) {
  if (!run_ip(network_of, arguments))
    throw std::runtime_error("VirtualNetwork: failed: ip " + arguments);
}

// Drops packets from addresses without a route back, broadcasts included (RFC 3704).
void drop_what_cannot_be_answered(pid_t network_of) {
  const std::string setting = "/proc/sys/net/ipv4/conf/eth0/rp_filter";
  if (Process({"sh", "-c", "echo 1 > " + setting}, network_of).wait() != 0)
    throw std::runtime_error("VirtualNetwork: cannot write " + setting);
}

}  // namespace

bool VirtualNetwork::available() {
  const pid_t probe = geteuid() == 0 ? hold_namespace() : 0;
  const bool possible = probe != 0 && run_ip(probe, "link add veth_a type veth peer name veth_b") &&
                        run_ip(probe, "link add br0 type bridge");
  end(probe);
  if (!possible) std::cout << "SKIPPED: needs root, network namespaces, veth and bridge\n";
  return possible;
}

VirtualNetwork::VirtualNetwork(int count) : switch_(hold_namespace()) {
  ip(switch_, "link add br0 type bridge mcast_snooping 0");
  ip(switch_, "link set br0 up");
  for (int n = 1; n <= count; ++n) {
    const pid_t host = hold_namespace();
    hosts_.push_back(host);
    ip(host, "link set lo up");
    add_interface(n);
    ip(host, "addr add " + address(n) + "/24 dev eth0");
  }
}

VirtualNetwork::~VirtualNetwork() {
  for (const pid_t host : hosts_) end(host);
  end(switch_);
}

void VirtualNetwork::set_link(int n, bool up) {
  ip(switch_, "link set port" + std::to_string(n) + (up ? " up" : " down"));
}

void VirtualNetwork::set_link_between(int a, int b, bool up) {
  const std::string command = up ? "route del blackhole " : "route add blackhole ";
  ip(host(a), command + address(b));
  ip(host(b), command + address(a));
}

// Both subnets that tests use are on the same switch.
void VirtualNetwork::set_address(int n, const std::string& address) {
  ip(host(n), "addr flush dev eth0");
  if (address.empty()) return;
  ip(host(n), "addr add " + address + " dev eth0");
  for (const char* subnet : {"10.77.0.0/24", "10.78.0.0/24"})
    ip(host(n), std::string("route replace ") + subnet + " dev eth0");
}

void VirtualNetwork::remove_interface(int n) {
  ip(host(n), "link del eth0");
}

void VirtualNetwork::add_interface(int n) {
  const std::string port = "port" + std::to_string(n);
  ip(switch_, "link add " + port + " type veth peer name eth0 netns " + std::to_string(host(n)));
  ip(switch_, "link set " + port + " master br0 up");
  ip(host(n), "link set eth0 up");
  drop_what_cannot_be_answered(host(n));
}

void VirtualNetwork::set_path_mtu(int n, int bytes) {
  ip(switch_, "link set port" + std::to_string(n) + " mtu " + std::to_string(bytes));
}

void VirtualNetwork::add_dead_interface(int n) {
  ip(host(n), "link add eth1 type bridge");
  ip(host(n), "addr add 10.99.0." + std::to_string(n) + "/24 dev eth1");
  ip(host(n), "link set eth1 up");
}

}  // namespace km
