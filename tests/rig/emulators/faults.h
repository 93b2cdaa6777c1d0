// SPDX-License-Identifier: MIT
// What an emulator is told to do wrong, on the command line or through a fifo while it runs. A command is one
// line:
//
//     unplug [MS]              the cable is pulled now, mid-frame, and put back after MS milliseconds
//     (without MS: never) quit                     ends the emulator NAME [COUNT [VALUE]]     the next COUNT
//     times (default 1, `always`) the fault NAME is done, with VALUE where it takes one clear nothing more
//     goes wrong
//
// `at FRAME COMMAND` runs the command in the middle of that frame, counted from the start of the emulator.
// Names: README.md.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace rig {

class Faults {
  public:
    // Understands -f COMMAND, -F FIFO (made when missing); returns how many arguments were taken at argv[i],
    // 0 for none.
    int argument(int argc, char** argv, int i);
    void command(const std::string& line);
    void poll_fifo();                   // without waiting
    int fifo() const { return fifo_; }  // -1: none

    // The fault is due now: counts it off and logs it.
    bool take(const char* name, int* value = nullptr);
    bool due(const char* name) const;  // without counting
    int value(const char* name) const;

    void middle_of_frame();  // by emulators, once a frame of the first stream

    bool quit = false;
    bool unplug = false;
    int replug_ms = -1;

  private:
    struct Fault {
        long count = 0;
        int value = 0;
    };
    std::map<std::string, Fault> faults_;
    std::multimap<long, std::string> scheduled_;
    std::string rest_;
    long frame_ = 0;
    int fifo_ = -1;
};

}  // namespace rig
