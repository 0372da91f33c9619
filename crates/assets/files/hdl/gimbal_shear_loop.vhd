-- gimbal_shear_loop : the loop of the spherical segment on a gimbal, with shear
--
-- As gimbal_loop, but the target x of the kinematics is a fractional derivative of
-- the input x, of which a shear of the skin is the result.
--
--   timer -> sample -> shear -> inverse -> .. as in gimbal_loop
--                 x ---^
--
-- Derivative and kinematics begin at the same sample. So the kinematics read the
-- derivative of the sample before: the tip follows x one sample period later.
--
-- generics LENGTH_WIDTH, LENGTH_FRAC      bits of the lengths, their fraction
--          CRANK_LENGTH, ROD_LENGTH       crank and rod, words of a length
--          OFFSET                         from the centre to the crank's axis
--          ANGLE_WIDTH                    bits of the angles
--          LIMIT                          largest angle of pitch and roll
--          GUARD, ROTATIONS               of the inverse kinematics
--          COUNT_WIDTH                    bits of the servos' position words
--          COUNT_NUM, COUNT_DEN           half turns per count, of the lever
--          STEP, STEP_FRAC                LSBs of the angle per count
--          P_WIDTH, P_FRAC                bits of the gain of the error, its fraction
--          D_WIDTH, D_FRAC                bits of the gain of its change, its fraction
--          WINDOW                         samples of the derivative; these seven are
--                                         those of pitch and roll
--          CRANK_STEP .. CRANK_WINDOW     the same seven of the crank
--          FORCE_WIDTH, FORCE_LIMIT       bits of the force, the spring's greatest
--          S_WIDTH, S_FRAC                bits of the stiffness, its fraction
--          K_WIDTH, K_FRAC                bits of the feedback, its fraction
--          GAIN, GAIN_FRAC                of impedance_control
--          DRIVE_WIDTH                    bits of the drives
--          TAKE_RADIUS, BUMPLESS, DECAY   of control_switch
--          PERIOD_WIDTH                   bits of the sample period, 2 to 30
--          SHEAR_WIDTH, SHEAR_FRAC        bits of shear_gain, its fraction
--          COEF_FRAC                      fraction bits of the derivative's weights
--          ORDER_NUM, ORDER_DEN           its order
--          MEMORY                         samples that count
-- in       count1, count2, count3 (1,COUNT_WIDTH-1,0)  servos of pitch, roll, crank
--          finger_force  (0,FORCE_WIDTH,0)             inwards
--          x, y, z       (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) [m] the target
--          proportional  (0,P_WIDTH-P_FRAC,P_FRAC)     of pitch and roll
--          derivative    (0,D_WIDTH-D_FRAC,D_FRAC)
--          crank_proportional (0,CRANK_P_WIDTH-CRANK_P_FRAC,CRANK_P_FRAC)
--          crank_derivative   (0,CRANK_D_WIDTH-CRANK_D_FRAC,CRANK_D_FRAC)
--          stiffness     (0,S_WIDTH-S_FRAC,S_FRAC)     force LSBs per length LSB
--          feedback      (0,K_WIDTH-K_FRAC,K_FRAC)
--          threshold_on, threshold_off (0,FORCE_WIDTH,0)
--          period        (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
--          shear_gain    (0,SHEAR_WIDTH-SHEAR_FRAC,SHEAR_FRAC)
-- out      drive1, drive2, drive3 (1,DRIVE_WIDTH-1,0)
--          mode          (0,1,0)                       1 = impedance control
-- latency  as gimbal_loop; x one sample period more. The period has to be at least
--          MEMORY + 2, and at least the 3 ROTATIONS + LENGTH_WIDTH + 16 of
--          gimbal_loop
-- reset    synchronous, to every clocked block; the second edge after it samples
-- overflow of the blocks; the derivative saturates
-- source   Pediredla et al., the shear stress as a fractional derivative
-- differs from the hardware: the paper makes its reference offline. Combinational
--          paths settle within the clock they change in, whatever their length.

library ieee;
use ieee.std_logic_1164.all;

entity gimbal_shear_loop is
  generic (
    LENGTH_WIDTH    : positive := 20;
    LENGTH_FRAC     : natural  := 22;
    CRANK_LENGTH    : positive := 52429;
    ROD_LENGTH      : positive := 243270;
    OFFSET          : natural  := 0;
    ANGLE_WIDTH     : positive := 20;
    LIMIT           : positive := 160199;
    GUARD           : natural  := 4;
    ROTATIONS       : positive := 20;
    COUNT_WIDTH     : positive := 11;
    COUNT_NUM       : positive := 5;
    COUNT_DEN       : positive := 3072;
    STEP            : positive := 873813;
    STEP_FRAC       : natural  := 10;
    P_WIDTH         : positive := 16;
    P_FRAC          : natural  := 4;
    D_WIDTH         : positive := 24;
    D_FRAC          : natural  := 0;
    WINDOW          : positive := 64;
    CRANK_STEP      : positive := 873813;
    CRANK_STEP_FRAC : natural  := 10;
    CRANK_P_WIDTH   : positive := 16;
    CRANK_P_FRAC    : natural  := 4;
    CRANK_D_WIDTH   : positive := 24;
    CRANK_D_FRAC    : natural  := 0;
    CRANK_WINDOW    : positive := 64;
    FORCE_WIDTH     : positive := 12;
    FORCE_LIMIT     : natural  := 3277;
    S_WIDTH         : positive := 16;
    S_FRAC          : natural  := 16;
    K_WIDTH         : positive := 8;
    K_FRAC          : natural  := 4;
    GAIN            : positive := 21695;
    GAIN_FRAC       : natural  := 32;
    DRIVE_WIDTH     : positive := 11;
    TAKE_RADIUS     : boolean  := true;
    BUMPLESS        : boolean  := true;
    DECAY           : natural range 0 to 15 := 4;
    PERIOD_WIDTH    : positive range 2 to 30 := 24;
    SHEAR_WIDTH     : positive := 24;
    SHEAR_FRAC      : natural  := 16;
    COEF_FRAC       : positive := 16;
    ORDER_NUM       : positive := 1;
    ORDER_DEN       : positive := 2;
    MEMORY          : positive range 2 to 254 := 16
  );
  port (
    clk                : in  std_logic;
    rst                : in  std_logic;
    count1             : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    count2             : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    count3             : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    finger_force       : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    x                  : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    y                  : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    z                  : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    proportional       : in  std_logic_vector(P_WIDTH - 1 downto 0);
    derivative         : in  std_logic_vector(D_WIDTH - 1 downto 0);
    crank_proportional : in  std_logic_vector(CRANK_P_WIDTH - 1 downto 0);
    crank_derivative   : in  std_logic_vector(CRANK_D_WIDTH - 1 downto 0);
    stiffness          : in  std_logic_vector(S_WIDTH - 1 downto 0);
    feedback           : in  std_logic_vector(K_WIDTH - 1 downto 0);
    threshold_on       : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    threshold_off      : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    period             : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    shear_gain         : in  std_logic_vector(SHEAR_WIDTH - 1 downto 0);
    drive1             : out std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    drive2             : out std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    drive3             : out std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    mode               : out std_logic
  );
end entity;

architecture rtl of gimbal_shear_loop is

  signal sample          : std_logic;
  signal shear_x         : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
  signal pitch           : std_logic_vector(ANGLE_WIDTH - 1 downto 0);
  signal roll            : std_logic_vector(ANGLE_WIDTH - 1 downto 0);
  signal crank           : std_logic_vector(ANGLE_WIDTH - 1 downto 0);
  signal rest            : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
  signal out_of_reach    : std_logic;
  signal busy            : std_logic;
  signal ready           : std_logic;
  signal position_drive  : std_logic_vector(DRIVE_WIDTH - 1 downto 0);
  signal radius          : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
  signal slope           : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
  signal impedance_drive : std_logic_vector(DRIVE_WIDTH - 1 downto 0);
  signal equilibrium     : std_logic_vector(LENGTH_WIDTH - 1 downto 0);

begin

  timer : entity work.sample_timer
    generic map (
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      period => period,
      sample => sample
    );

  shear : entity work.fractional_difference
    generic map (
      IN_INT     => LENGTH_WIDTH - LENGTH_FRAC - 1,
      IN_FRAC    => LENGTH_FRAC,
      OUT_INT    => LENGTH_WIDTH - LENGTH_FRAC - 1,
      OUT_FRAC   => LENGTH_FRAC,
      GAIN_WIDTH => SHEAR_WIDTH,
      GAIN_FRAC  => SHEAR_FRAC,
      COEF_FRAC  => COEF_FRAC,
      ORDER_NUM  => ORDER_NUM,
      ORDER_DEN  => ORDER_DEN,
      MEMORY     => MEMORY
    )
    port map (
      clk    => clk,
      rst    => rst,
      u      => x,
      gain   => shear_gain,
      sample => sample,
      y      => shear_x
    );

  inverse : entity work.gimbal_inverse
    generic map (
      LENGTH_WIDTH => LENGTH_WIDTH,
      LENGTH_FRAC  => LENGTH_FRAC,
      CRANK_LENGTH => CRANK_LENGTH,
      ROD_LENGTH   => ROD_LENGTH,
      OFFSET       => OFFSET,
      ANGLE_WIDTH  => ANGLE_WIDTH,
      LIMIT        => LIMIT,
      GUARD        => GUARD,
      ROTATIONS    => ROTATIONS
    )
    port map (
      clk          => clk,
      rst          => rst,
      start        => sample,
      x            => shear_x,
      y            => y,
      z            => z,
      pitch        => pitch,
      roll         => roll,
      crank        => crank,
      radius       => rest,
      out_of_reach => out_of_reach,
      busy         => busy,
      ready        => ready
    );

  servo1 : entity work.servo_control
    generic map (
      ANGLE_WIDTH => ANGLE_WIDTH,
      COUNT_WIDTH => COUNT_WIDTH,
      STEP        => STEP,
      STEP_FRAC   => STEP_FRAC,
      P_WIDTH     => P_WIDTH,
      P_FRAC      => P_FRAC,
      D_WIDTH     => D_WIDTH,
      D_FRAC      => D_FRAC,
      DRIVE_WIDTH => DRIVE_WIDTH,
      WINDOW      => WINDOW
    )
    port map (
      clk          => clk,
      rst          => rst,
      desired      => pitch,
      count        => count1,
      proportional => proportional,
      derivative   => derivative,
      sample       => ready,
      drive        => drive1
    );

  servo2 : entity work.servo_control
    generic map (
      ANGLE_WIDTH => ANGLE_WIDTH,
      COUNT_WIDTH => COUNT_WIDTH,
      STEP        => STEP,
      STEP_FRAC   => STEP_FRAC,
      P_WIDTH     => P_WIDTH,
      P_FRAC      => P_FRAC,
      D_WIDTH     => D_WIDTH,
      D_FRAC      => D_FRAC,
      DRIVE_WIDTH => DRIVE_WIDTH,
      WINDOW      => WINDOW
    )
    port map (
      clk          => clk,
      rst          => rst,
      desired      => roll,
      count        => count2,
      proportional => proportional,
      derivative   => derivative,
      sample       => ready,
      drive        => drive2
    );

  servo3 : entity work.servo_control
    generic map (
      ANGLE_WIDTH => ANGLE_WIDTH,
      COUNT_WIDTH => COUNT_WIDTH,
      STEP        => CRANK_STEP,
      STEP_FRAC   => CRANK_STEP_FRAC,
      P_WIDTH     => CRANK_P_WIDTH,
      P_FRAC      => CRANK_P_FRAC,
      D_WIDTH     => CRANK_D_WIDTH,
      D_FRAC      => CRANK_D_FRAC,
      DRIVE_WIDTH => DRIVE_WIDTH,
      WINDOW      => CRANK_WINDOW
    )
    port map (
      clk          => clk,
      rst          => rst,
      desired      => crank,
      count        => count3,
      proportional => crank_proportional,
      derivative   => crank_derivative,
      sample       => ready,
      drive        => position_drive
    );

  lever : entity work.crank_table
    generic map (
      LENGTH_WIDTH => LENGTH_WIDTH,
      LENGTH_FRAC  => LENGTH_FRAC,
      CRANK_LENGTH => CRANK_LENGTH,
      ROD_LENGTH   => ROD_LENGTH,
      OFFSET       => OFFSET,
      COUNT_WIDTH  => COUNT_WIDTH,
      COUNT_NUM    => COUNT_NUM,
      COUNT_DEN    => COUNT_DEN
    )
    port map (
      clk    => clk,
      rst    => rst,
      count  => count3,
      radius => radius,
      slope  => slope
    );

  impedance : entity work.impedance_control
    generic map (
      LENGTH_WIDTH => LENGTH_WIDTH,
      LENGTH_FRAC  => LENGTH_FRAC,
      FORCE_WIDTH  => FORCE_WIDTH,
      FORCE_LIMIT  => FORCE_LIMIT,
      S_WIDTH      => S_WIDTH,
      S_FRAC       => S_FRAC,
      K_WIDTH      => K_WIDTH,
      K_FRAC       => K_FRAC,
      GAIN         => GAIN,
      GAIN_FRAC    => GAIN_FRAC,
      DRIVE_WIDTH  => DRIVE_WIDTH
    )
    port map (
      rest         => equilibrium,
      radius       => radius,
      slope        => slope,
      finger_force => finger_force,
      stiffness    => stiffness,
      feedback     => feedback,
      drive        => impedance_drive
    );

  switch : entity work.control_switch
    generic map (
      DRIVE_WIDTH  => DRIVE_WIDTH,
      FORCE_WIDTH  => FORCE_WIDTH,
      LENGTH_WIDTH => LENGTH_WIDTH,
      LENGTH_FRAC  => LENGTH_FRAC,
      TAKE_RADIUS  => TAKE_RADIUS,
      BUMPLESS     => BUMPLESS,
      DECAY        => DECAY
    )
    port map (
      clk             => clk,
      rst             => rst,
      position_drive  => position_drive,
      impedance_drive => impedance_drive,
      finger_force    => finger_force,
      threshold_on    => threshold_on,
      threshold_off   => threshold_off,
      radius          => radius,
      rest            => rest,
      sample          => ready,
      drive           => drive3,
      mode            => mode,
      equilibrium     => equilibrium
    );

end architecture;
