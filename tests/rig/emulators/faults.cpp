// SPDX-License-Identifier: MIT
#include "faults.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

namespace rig {

int Faults::argument(int argc, char** argv, int i) {
    if (i + 1 >= argc) return 0;
    if (std::strcmp(argv[i], "-f") == 0) {
        command(argv[i + 1]);
        return 2;
    }
    if (std::strcmp(argv[i], "-F") == 0) {
        mkfifo(argv[i + 1], 0600);
        // Open for writing too, so that it never ends when a writer goes.
        fifo_ = open(argv[i + 1], O_RDWR | O_NONBLOCK | O_CLOEXEC);
        if (fifo_ < 0) std::perror(argv[i + 1]), std::exit(2);
        return 2;
    }
    return 0;
}

void Faults::command(const std::string& line) {
    std::istringstream words(line);
    std::string name, count;
    if (!(words >> name)) return;
    if (name == "at") {
        long frame = 0;
        std::string what;
        words >> frame;
        std::getline(words >> std::ws, what);
        scheduled_.emplace(frame, what);
        return;
    }
    std::printf("emulator: command %s\n", line.c_str());
    if (name == "quit")
        quit = true;
    else if (name == "clear")
        faults_.clear();
    else if (name == "unplug") {
        unplug = true;
        if (!(words >> replug_ms)) replug_ms = -1;
    } else {
        Fault fault{1, 0};
        if (words >> count) fault.count = count == "always" ? LONG_MAX : std::atol(count.c_str());
        words >> fault.value;
        faults_[name] = fault;
    }
}

void Faults::poll_fifo() {
    char bytes[512];
    ssize_t n = 0;
    while (fifo_ >= 0 && (n = read(fifo_, bytes, sizeof bytes)) > 0)
        rest_.append(bytes, static_cast<std::size_t>(n));
    for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos; rest_.erase(0, end + 1))
        command(rest_.substr(0, end));
}

bool Faults::take(const char* name, int* value) {
    const auto it = faults_.find(name);
    if (it == faults_.end() || it->second.count <= 0) return false;
    if (value != nullptr) *value = it->second.value;
    if (it->second.count != LONG_MAX) {
        --it->second.count;
        std::printf("emulator: fault %s in frame %ld\n", name, frame_);
    }
    return true;
}

bool Faults::due(const char* name) const {
    const auto it = faults_.find(name);
    return it != faults_.end() && it->second.count > 0;
}

int Faults::value(const char* name) const {
    const auto it = faults_.find(name);
    return it == faults_.end() ? 0 : it->second.value;
}

void Faults::middle_of_frame() {
    ++frame_;
    for (auto it = scheduled_.begin(); it != scheduled_.end() && it->first <= frame_;
         it = scheduled_.erase(it))
        command(it->second);
}

}  // namespace rig
