void _exit(int);
int main(void);
void initialise_monitor_handles(void);
void reset_handler(void)
{
  *(volatile unsigned *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit */
  __asm volatile("dsb; isb");
  initialise_monitor_handles();
  _exit(main());
}
__attribute__((section(".vectors"), used)) static void (*const vectors[2])(void) = {
  (void (*)(void))0x20400000, reset_handler};
