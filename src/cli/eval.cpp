#include "cli/common.h"
namespace burin::cli { void add_eval(CLI::App&, int*) {} }
