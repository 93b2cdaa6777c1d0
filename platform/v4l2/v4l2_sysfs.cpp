// SPDX-License-Identifier: MIT
#include "platform/v4l2/v4l2_sysfs.h"

#include <dirent.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace burin {
namespace {

// One line of a file of sysfs, without its end.
bool read_line(const char* folder, const char* file, char* out, std::size_t room) {
    char path[PATH_MAX];
    if (std::snprintf(path, sizeof path, "%s/%s", folder, file) >= static_cast<int>(sizeof path))
        return false;
    const int fd = ::open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return false;
    const ssize_t got = ::read(fd, out, room - 1);
    ::close(fd);
    if (got < 0) return false;
    out[got] = 0;
    out[std::strcspn(out, "\n")] = 0;
    return true;
}

// What a link of sysfs points to; false when it is not there or too long.
bool resolve(const char* folder, const char* link, char* out, std::size_t room) {
    char path[PATH_MAX], resolved[PATH_MAX];
    if (std::snprintf(path, sizeof path, "%s/%s", folder, link) >= static_cast<int>(sizeof path))
        return false;
    if (!::realpath(path, resolved) || std::strlen(resolved) >= room) return false;
    std::memcpy(out, resolved, std::strlen(resolved) + 1);
    return true;
}

std::uint32_t hexadecimal(const char* folder, const char* file) {
    char text[16];
    return read_line(folder, file, text, sizeof text)
               ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 16))
               : 0;
}

void find_parent(V4l2Found* f) {
    std::snprintf(f->parent, sizeof f->parent, "%s", f->device);
    const char* last = std::strrchr(f->device, '/');
    // An interface of USB is named "1-2.3:1.0" below its device "1-2.3".
    if (last && std::strchr(last, ':') && std::strstr(f->device, "/usb")) {
        f->interface = static_cast<int>(hexadecimal(f->device, "bInterfaceNumber"));
        f->parent[last - f->device] = 0;
        f->vendor = hexadecimal(f->parent, "idVendor");
        f->product = hexadecimal(f->parent, "idProduct");
        if (!read_line(f->parent, "serial", f->serial, sizeof f->serial)) f->serial[0] = 0;
    }
    const char* name = std::strrchr(f->parent, '/');
    std::snprintf(f->location, sizeof f->location, "%.63s", name ? name + 1 : f->parent);
}

bool describe(const char* entry, V4l2Found* f) {
    char folder[128], text[16], driver[200];
    *f = V4l2Found();
    std::snprintf(folder, sizeof folder, "/sys/class/video4linux/%.32s", entry);
    std::snprintf(f->node, sizeof f->node, "/dev/%.18s", entry);
    if (!read_line(folder, "name", f->name, sizeof f->name)) return false;
    if (read_line(folder, "index", text, sizeof text)) f->index = std::atoi(text);
    // A node of a virtual driver has no device: it is its own.
    if (!resolve(folder, "device", f->device, sizeof f->device))
        std::snprintf(f->device, sizeof f->device, "%s", folder);
    if (resolve(f->device, "driver", driver, sizeof driver))
        std::snprintf(f->driver, sizeof f->driver, "%.31s", std::strrchr(driver, '/') + 1);
    find_parent(f);
    return true;
}

}  // namespace

int find_v4l2_nodes(V4l2Found* found) {
    DIR* folder = ::opendir("/sys/class/video4linux");
    if (!folder) return 0;
    int count = 0;
    while (const dirent* e = ::readdir(folder))
        if (std::strncmp(e->d_name, "video", 5) == 0 && count < kMaxV4l2Nodes &&
            describe(e->d_name, &found[count]))
            ++count;
    ::closedir(folder);
    std::sort(found, found + count, [](const V4l2Found& a, const V4l2Found& b) {
        return std::atoi(a.node + 10) < std::atoi(b.node + 10);
    });
    return count;
}

std::size_t read_usb_descriptors(const V4l2Found& f, std::uint8_t* out, std::size_t room) {
    char path[PATH_MAX];
    std::snprintf(path, sizeof path, "%s/descriptors", f.parent);
    const int fd = ::open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return 0;
    const ssize_t got = ::read(fd, out, room);
    ::close(fd);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
}

}  // namespace burin
