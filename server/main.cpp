// The program `retake`.
#include "server/commands/command_line.h"

int main(int count, char** arguments) {
  return retake::run_command_line(count, arguments);
}
