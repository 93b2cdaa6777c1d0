// SPDX-License-Identifier: MIT
#include "suite/job.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "support/frames.h"

extern char** environ;

namespace burin::bench {
namespace {

const double kStart = now_ms();

// Starts the command with its stdout on `out` (-1: ours) and returns its process, -1 when it cannot be
// started.
pid_t start(const std::vector<std::string>& command, int out) {
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    if (out >= 0) posix_spawn_file_actions_adddup2(&actions, out, 1);
    pid_t pid = -1;
    const int error = posix_spawn(&pid, command[0].c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    return error == 0 ? pid : -1;
}

bool finish(pid_t pid, const std::vector<std::string>& command) {
    int status = 0;
    if (pid > 0 && waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return true;
    std::string line;
    for (const std::string& word : command) line += " " + word;
    std::fprintf(stderr, "suite: failed:%s\n", line.c_str());
    return false;
}

}  // namespace

double seconds_since_start() { return 1e-3 * (now_ms() - kStart); }

std::string Subject::id() const {
    return program + "-" + std::to_string(voxel_mm) + "mm-" + std::to_string(threads) + "t" +
           (colour ? "-colour" : "");
}

Json run_json(const std::vector<std::string>& command) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return nullptr;
    const pid_t pid = start(command, ends[1]);
    close(ends[1]);
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;)
        text.append(buffer, static_cast<std::size_t>(n));
    close(ends[0]);
    if (!finish(pid, command)) return nullptr;
    Json json = Json::parse(text, nullptr, false);
    if (!json.is_discarded()) return json;
    std::fprintf(stderr, "suite: %s printed no JSON\n", command[0].c_str());
    return nullptr;
}

bool run_plain(const std::vector<std::string>& command) { return finish(start(command, -1), command); }

bool run_round(std::vector<Job>& jobs, int round, double deadline_s, bool* ran) {
    *ran = false;
    for (Job& job : jobs) {
        const bool first = job.outputs.empty();
        if (round < job.first_round || static_cast<int>(job.outputs.size()) >= job.most_runs) continue;
        // A job's runs vary with what else the machine does.
        if (!(first && job.required) && seconds_since_start() + 1.2 * job.longest_s > deadline_s) continue;
        const double start = seconds_since_start();
        const Json output = run_json(job.command);
        if (output.is_null()) return false;
        job.outputs.push_back(output);
        const double seconds = seconds_since_start() - start;
        job.longest_s = std::max(job.longest_s, seconds);
        *ran = true;
        std::fprintf(stderr, "  %-32s round %d %6.1f s\n", job.name.c_str(), round + 1, seconds);
    }
    return true;
}

}  // namespace burin::bench
