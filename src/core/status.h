// SPDX-License-Identifier: MIT
// Errors as values. A Status never allocates, so the runtime may return one at any time.
#pragma once

#include <cstdarg>
#include <utility>

namespace burin {

// The numeric values are those of burin_status in include/burin/burin.h (a test compares them).
enum class Code : int {
    ok = 0,
    invalid_argument = -1,     // a value the caller gave is out of its stated range
    insufficient_memory = -2,  // the bytes handed over are too few; the text says how many are needed
    io = -3,                   // the operating system refused: missing file, full disk, no permission
    format = -4,               // a file's content is not what its format demands
    state = -5,                // the call does not fit the object's state
    unsupported = -6,          // valid input that this build or this version cannot handle
    cancelled = -7,            // the caller asked to stop
    timeout = -8,              // nothing came before the deadline
    disconnected = -9,         // the device is gone
    busy = -10,                // another program or driver has the device
    denied = -11,              // no permission; the text says what to do
    ended = -12,               // a recorded source has no more frames
};

// One line of text beside a code: names the file, the value and what was expected.
class [[nodiscard]] Status {
  public:
    Status() = default;
    // printf-style; text beyond the buffer is cut.
    static Status error(Code code, const char* format, ...) __attribute__((format(printf, 2, 3)));

    bool ok() const { return code_ == Code::ok; }
    explicit operator bool() const { return ok(); }
    Code code() const { return code_; }
    const char* text() const { return text_; }

  private:
    Code code_ = Code::ok;
    char text_[500] = "";  // a path of some 200 bytes twice, plus the sentence around it
};

// A value, or the Status that says why there is none. `value` is only meaningful when ok().
template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : value_(std::move(value)) {}  // NOLINT: implicit by intention, as std::expected
    Result(Status status) : status_(status) {}     // NOLINT
    bool ok() const { return status_.ok(); }
    explicit operator bool() const { return ok(); }
    const Status& status() const { return status_; }
    T& operator*() { return value_; }
    const T& operator*() const { return value_; }
    T* operator->() { return &value_; }
    const T* operator->() const { return &value_; }

  private:
    Status status_;
    T value_{};
};

// Leaves the calling function with the status when it is an error.
#define BURIN_TRY(expression)                                                        \
    do {                                                                             \
        if (::burin::Status burin_try_status = (expression); !burin_try_status.ok()) \
            return burin_try_status;                                                 \
    } while (0)

}  // namespace burin
