// SPDX-License-Identifier: MIT
#include "vusb.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace rig {

namespace {

enum : std::uint32_t { kSubmit = 1, kUnlink = 2, kReturnSubmit = 3, kReturnUnlink = 4 };
constexpr int kPorts = 8;  // high-speed ports of vhci_hcd.0

volatile std::sig_atomic_t terminated = 0;

bool transfer(int fd, void* data, std::size_t size, bool out) {
    auto* p = static_cast<std::uint8_t*>(data);
    while (size > 0) {
        const ssize_t n = out ? write(fd, p, size) : read(fd, p, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        p += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

// A port that is still being torn down is not to be asked for: the kernel then keeps the port's lock, and
// whoever wants it next sleeps for good (seen with Linux 6.1). Rows of the file: hub, port, state (4: free),
// speed, device, socket, name.
bool port_is_free(int number) {
    std::FILE* status = std::fopen("/sys/devices/platform/vhci_hcd.0/status", "r");
    if (status == nullptr) return true;  // attaching says what is wrong
    char line[256];
    bool free_now = false;
    while (std::fgets(line, sizeof line, status) != nullptr) {
        int port = -1, state = -1;
        if (std::sscanf(line, "hs %d %d", &port, &state) == 2 && port == number) free_now = state == 4;
    }
    std::fclose(status);
    return free_now;
}

}  // namespace

double now_s() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void VirtualBus::add(UsbDevice& device, UsbSpeed speed) {
    Port port;
    port.device = &device;
    port.speed = speed;
    ports_.push_back(std::move(port));
}

bool VirtualBus::plug(Port& port) {
    const int first = port.number >= 0 ? port.number : 0, last = port.number >= 0 ? port.number : kPorts - 1;
    for (int number = first; number <= last; ++number) {
        if (!port_is_free(number)) continue;
        int pair[2];
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
            std::perror("socketpair"), std::exit(1);
        const int room =
            8 << 20;  // whole frames fit in, so that neither end waits for the other in mid-frame
        for (const int s : pair) {
            setsockopt(s, SOL_SOCKET, SO_SNDBUFFORCE, &room, sizeof room);
            setsockopt(s, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
        }
        const int attach = open("/sys/devices/platform/vhci_hcd.0/attach", O_WRONLY | O_CLOEXEC);
        if (attach < 0) std::perror("vhci_hcd.0/attach (is the module vhci-hcd loaded?)"), std::exit(1);
        char line[64];
        const int n = std::snprintf(line, sizeof line, "%d %d %d %d", number, pair[0], 1 << 16 | (number + 1),
                                    port.speed);
        const bool attached = write(attach, line, static_cast<std::size_t>(n)) == n;
        close(attach);
        close(pair[0]);   // the kernel has its own reference
        if (!attached) {  // taken, or still being torn down
            close(pair[1]);
            continue;
        }
        port.number = number;
        port.socket = pair[1];
        std::memset(port.device->alternate, 0, sizeof port.device->alternate);
        port.device->reset();
        std::printf("emulator: plugged into port %d\n", number);
        return true;
    }
    return false;
}

void VirtualBus::unplug(Port& port) {
    if (port.socket < 0) return;
    close(port.socket);
    port.socket = -1;
    port.waiting.clear();
    std::printf("emulator: unplugged from port %d\n", port.number);
}

int VirtualBus::run() {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::signal(SIGPIPE, SIG_IGN);
    struct sigaction action {};
    action.sa_handler = [](int) { terminated = 1; };
    sigaction(SIGTERM, &action, nullptr);
    sigaction(SIGINT, &action, nullptr);
    const double began = now_s();
    for (Port& port : ports_) {
        while (!plug(port)) {
            if (now_s() - began > 5)
                std::fprintf(stderr, "emulator: no free port of vhci_hcd\n"), std::exit(1);
            usleep(20000);
        }
    }
    while (terminated == 0 && !faults_.quit) {
        std::vector<pollfd> fds;
        bool waiting = false;
        for (const Port& port : ports_) {
            fds.push_back({port.socket, POLLIN, 0});  // negative ones are passed over
            waiting = waiting || !port.waiting.empty() || port.socket < 0;
        }
        fds.push_back({faults_.fifo(), POLLIN, 0});
        if (poll(fds.data(), fds.size(), waiting ? 1 : 1000) < 0 && errno != EINTR)
            std::perror("poll"), std::exit(1);
        faults_.poll_fifo();
        for (std::size_t i = 0; i < ports_.size(); ++i) {
            Port& port = ports_[i];
            if (port.socket < 0) continue;
            bool alive = true;
            if ((fds[i].revents & (POLLIN | POLLHUP)) != 0)
                alive = receive(port);
            else if (!port.waiting.empty())
                alive = serve_waiting(port);
            if (!alive && !faults_.unplug) {
                // The host has detached the port; the emulator ends, as a camera loses its power.
                unplug(port);
                if (std::all_of(ports_.begin(), ports_.end(), [](const Port& p) { return p.socket < 0; }) &&
                    replug_at_ == 0)
                    return 0;
            }
        }
        if (faults_.unplug) {
            faults_.unplug = false;
            for (Port& port : ports_) unplug(port);
            if (faults_.replug_ms >= 0) replug_at_ = now_s() + 1e-3 * faults_.replug_ms;
        }
        if (replug_at_ > 0 && now_s() >= replug_at_) {
            bool all = true;
            for (Port& port : ports_) all = (port.socket >= 0 || plug(port)) && all;
            if (all) replug_at_ = 0;
        }
    }
    for (Port& port : ports_) unplug(port);
    return 0;
}

bool VirtualBus::receive(Port& port) {
    std::uint32_t h[12];
    if (!transfer(port.socket, h, sizeof h, false)) return false;
    for (int i = 0; i < 10; ++i) h[i] = ntohl(h[i]);
    if (h[0] == kUnlink) {
        int status = 0;
        const auto it = std::find_if(port.waiting.begin(), port.waiting.end(),
                                     [&](const Request& r) { return r.sequence == h[5]; });
        if (it != port.waiting.end()) {
            port.waiting.erase(it);
            status = -ECONNRESET;
        }
        std::uint32_t r[12] = {
            htonl(kReturnUnlink), htonl(h[1]), 0, 0, 0, htonl(static_cast<std::uint32_t>(status))};
        return transfer(port.socket, r, sizeof r, true);
    }
    Request request;
    request.sequence = h[1];
    request.in = h[3] != 0;
    request.endpoint = static_cast<int>(h[4]);
    request.length = static_cast<int>(h[6]);
    request.start_frame = static_cast<int>(h[7]);
    const int packets = static_cast<std::int32_t>(h[8]) > 0 ? static_cast<int>(h[8]) : 0;
    const auto* s = reinterpret_cast<const std::uint8_t*>(h + 10);
    request.setup = {s[0], s[1], static_cast<std::uint16_t>(get16(s + 2)),
                     static_cast<std::uint16_t>(get16(s + 4)), static_cast<std::uint16_t>(get16(s + 6))};
    request.data.resize(static_cast<std::size_t>(request.length) +
                        1024);  // replies may be longer than asked for: cut later
    if (!request.in && request.length > 0 &&
        !transfer(port.socket, request.data.data(), static_cast<std::size_t>(request.length), false))
        return false;
    if (packets > 0) {
        request.packets.resize(4 * static_cast<std::size_t>(packets));
        if (!transfer(port.socket, request.packets.data(), 16 * static_cast<std::size_t>(packets), false))
            return false;
        for (std::uint32_t& v : request.packets) v = ntohl(v);
    }
    if (request.endpoint == 0) {
        if ((request.setup.type & 0x60) != 0 && faults_.take("silent_control")) {
            request.never = true;
            port.waiting.push_back(std::move(request));
            return true;
        }
        return answer_control(port, request);
    }
    if (!request.in) return reply(port, request, 0, request.length, 0);
    port.waiting.push_back(std::move(request));
    return true;
}

bool VirtualBus::answer_control(Port& port, Request& request) {
    int n = (request.setup.type & 0x60) == 0 ? standard(*port.device, request.setup, request.data.data())
            : faults_.take("stall_control")  ? kStall
                                             : port.device->control(request.setup, request.data.data());
    n = std::min(n, request.length);
    return reply(port, request, n < 0 ? n : 0, n < 0 ? 0 : request.in ? n : request.length, 0);
}

bool VirtualBus::serve_waiting(Port& port) {
    if (faults_.due("silent")) return true;
    for (auto it = port.waiting.begin(); it != port.waiting.end();) {
        bool done = false;
        if (!it->never && !serve_one(port, *it, &done)) return false;
        if (faults_.unplug) return true;  // by a command in mid-frame
        it = done ? port.waiting.erase(it) : std::next(it);
    }
    return true;
}

bool VirtualBus::serve_one(Port& port, Request& request, bool* done) {
    *done = false;
    if (request.packets.empty()) {
        int n = port.device->in(request.endpoint, request.data.data(), request.length);
        if (n == kLater) return true;
        *done = true;
        if (faults_.take("bulk_error")) n = -EPROTO;
        if (n > 0 && faults_.take("bulk_stall")) n = kStall;
        return reply(port, request, n < 0 ? n : 0, std::max(n, 0), 0);
    }
    int total = 0, errors = 0;
    for (std::size_t i = 0; i < request.packets.size(); i += 4) {
        std::uint32_t* p = &request.packets[i];
        int n = port.device->in(request.endpoint, request.data.data() + p[0], static_cast<int>(p[1]));
        if (n == kLater) {
            if (i == 0) return true;
            n = 0;
        }
        int status = 0;
        if (n > 0 && faults_.take("lost_iso")) n = 0, status = -EXDEV;
        if (n > 0 && faults_.take("empty_iso")) n = 0;
        p[2] = static_cast<std::uint32_t>(n);
        p[3] = static_cast<std::uint32_t>(status);
        total += n;
        errors += status != 0 ? 1 : 0;
        if (faults_.unplug) return true;
    }
    *done = true;
    return reply(port, request, 0, total, errors);
}

bool VirtualBus::reply(Port& port, Request& request, int status, int actual, int errors) {
    std::uint32_t h[12] = {htonl(kReturnSubmit),
                           htonl(request.sequence),
                           0,
                           0,
                           0,
                           htonl(static_cast<std::uint32_t>(status)),
                           htonl(static_cast<std::uint32_t>(actual)),
                           htonl(static_cast<std::uint32_t>(request.start_frame)),
                           htonl(static_cast<std::uint32_t>(request.packets.size() / 4)),
                           htonl(static_cast<std::uint32_t>(errors))};
    if (!transfer(port.socket, h, sizeof h, true)) return false;
    if (request.packets.empty())
        return !request.in || actual == 0 ||
               transfer(port.socket, request.data.data(), static_cast<std::size_t>(actual), true);
    for (std::size_t i = 0; request.in && i < request.packets.size(); i += 4)
        if (request.packets[i + 2] != 0 &&
            !transfer(port.socket, request.data.data() + request.packets[i], request.packets[i + 2], true))
            return false;
    std::vector<std::uint32_t> wire(request.packets);
    for (std::uint32_t& v : wire) v = htonl(v);
    return transfer(port.socket, wire.data(), 4 * wire.size(), true);
}

int VirtualBus::standard(UsbDevice& device, const Setup& setup, std::uint8_t* data) {
    const auto send = [&](const std::vector<std::uint8_t>& bytes) {
        const auto n = std::min<std::size_t>(bytes.size(), setup.length);
        std::copy_n(bytes.begin(), n, data);
        return static_cast<int>(n);
    };
    const unsigned index = setup.value & 255;
    switch (setup.type << 8 | setup.request) {
        case 0x8006:  // GET_DESCRIPTOR
            if (setup.value >> 8 == 1) return send(device.device);
            if (setup.value >> 8 == 2) return send(device.config);
            if (setup.value >> 8 == 3) {
                if (index == 0) return send({4, 3, 9, 4});  // US English
                if (index > device.strings.size()) return kStall;
                std::vector<std::uint8_t> text = {
                    static_cast<std::uint8_t>(2 + 2 * device.strings[index - 1].size()), 3};
                for (const char c : device.strings[index - 1]) put16(text, static_cast<unsigned char>(c));
                return send(text);
            }
            return kStall;  // no device qualifier, no BOS
        case 0x8000:
        case 0x8100:
        case 0x8200:
            return send({0, 0});  // GET_STATUS
        case 0x8008:
            return send({1});  // GET_CONFIGURATION
        case 0x810a:
            return send({device.alternate[setup.index & 7]});  // GET_INTERFACE
        case 0x0001:
        case 0x0003:
        case 0x0009:
        case 0x0101:
        case 0x0103:
        case 0x0201:
        case 0x0203:
            return 0;
        case 0x010b:  // SET_INTERFACE
            device.alternate[setup.index & 7] = static_cast<std::uint8_t>(setup.value);
            device.set_alternate(setup.index & 7, setup.value);
            return 0;
        default:
            return kStall;
    }
}

}  // namespace rig
