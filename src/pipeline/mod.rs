//! The operations that the command line, recipes and the studio all call, over a World and a Task.
